//! Every code that a message can carry, with the explanation that `rfm explain CODE` prints.

/// The stable name of a kind of message: `E…` for errors, `W…` for warnings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Code(pub &'static str);

macro_rules! codes {
    ($($name:ident = $code:literal : $text:literal;)*) => {
        impl Code {
            $(
                #[doc = concat!("The code `", $code, "`; [`explain`] gives its explanation.")]
                pub const $name: Self = Self($code);
            )*
        }
        const TABLE: &[(&str, &str)] = &[$(($code, $text)),*];
    };
}

/// The long explanation of a code, in upper or lower case. `None` if there is no such code.
pub fn explain(code: &str) -> Option<&'static str> {
    TABLE.iter().find(|(name, _)| name.eq_ignore_ascii_case(code)).map(|&(_, text)| text)
}

/// All codes with their explanations, in the order of what they are about.
pub fn explanations() -> impl Iterator<Item = (&'static str, &'static str)> {
    TABLE.iter().copied()
}

codes! {
VERSION_UNKNOWN = "E0001":
"The first line of a file names the edition of the language it is written in: `rfm 1`. This file names an
edition that this program does not know. Install a newer rfm, or write `rfm 1` if the file uses nothing newer.";
VERSION_MISSING = "W0002":
"The file does not start with `rfm 1`. It is read as edition 1, but a later rfm could read it differently.
Write `rfm 1` as the first line.";
EMPTY_FILE = "E0003":
"The file has no item: it is empty, or all of it is a comment. A file defines solids, and scenes with a fluid.

    rfm 1
    solid ball = sphere(1)";
SYNTAX = "E0101":
"The text does not fit the grammar at the marked place. Items start with one of the words `param`, `let`, `fn`,
`solid`, `scene`, `import`; an item ends where the next one begins.

    rfm 1
    param r = 0.5
    solid ball = x² + y² + z² <= r²";
TOO_DEEP = "E0102":
"Brackets and folds are nested deeper than 200 levels, or calls of functions deeper than 64. Name a part with `let`
and use the name.";
TOO_LONG = "E0103":
"The file is longer than the 256 MiB that are read at most.";
UNKNOWN_UNIT = "E0104":
"A word right after a number on the same line is read as its unit, and this one is not known. Lengths: m cm mm
um km; time: s ms us min h; mass: kg g; force: N mN kN; pressure: Pa mPa kPa MPa; energy: J kJ; angle: deg rad; rate: Hz rpm;
combined with `/`, `·` and `^`: `kg/m^3`, `Pa·s`, `m/s^2`, `deg/s`.";
EQUALITY = "E0105":
"`a == b` would be a surface of zero thickness: no point is inside it, so it can neither be meshed nor hit.
Write a thin layer instead, `-t <= a - b <= t`, or `a <= b` for the half of space on one side.";
CHAIN = "E0106":
"A chain of comparisons is a layer between two bounds, `a <= e <= b`, and means the product (e − a)·(b − e). Three
or more bounds, or bounds that point in different directions, have no such meaning: join the parts with `and`.";
UNKNOWN_NAME = "E0201":
"The name is not defined at this place. Names are defined by `param`, `let`, `fn` and `solid` further up in the
file; `x`, `y`, `z`, `pi` and the standard solids and functions are always there.";
DUPLICATE_NAME = "E0202":
"Two items have the same name. All items share one set of names; rename one of them.";
RESERVED_NAME = "E0203":
"`x`, `y`, `z` and `pi` always mean the coordinates and the number, and `t` the time: an item cannot take their names. A
file in which nothing moves may define a param or a value `t` all the same, as may functions and folds; from then on it
is that, and the file has no time. In its scenes `t` is an error, because there it would be the time.";
NOT_A_FUNCTION = "E0204":
"Brackets after a name call a function, but this name is a value (or the other way round).";
ARGUMENTS = "E0205":
"The arguments do not fit the function: too many, too few, or a name that it does not have. Arguments are given in
order, then by name: `cylinder(0.2, h = 1)`.";
RECURSION = "E0206":
"A function calls itself. Everything is unrolled when the file is compiled, so a function cannot recurse; use
`any i in 0..n:` or `all i in 0..n:` for repetition.";
WRONG_TYPE = "E0207":
"A number (or field) was expected and a vector or text was found, or the other way round. Vectors are written
`[a, b, c]`; texts are written in double quotes.";
NOT_CONSTANT = "E0208":
"This value must be known when the file is compiled: it may use numbers, params and constants, but not x, y, z,
nor the time t. (Displacements and angles of `.move` and `.rotate` may depend on t.)";
OUT_OF_RANGE = "E0209":
"The value lies outside the range that is allowed for it: a size that must be positive, or a param outside its
declared `in a .. b`.";
TOO_LARGE = "E0210":
"The file unrolls to more operations than the limit: 1 million, or 4 for each byte of the file and what it imports if that is
more, or what --max-nodes says. A range such as `0..1000000` may have too many members.";
OVERRIDE = "E0211":
"A param is set that the file does not declare with `param name = …`, or to a value outside the range that the declaration
states, or with a unit of another kind than the one that the file states. Where the file states none, any unit is accepted. Params
are set by `-D name=value`, by files that `-P` names, or by a program.";
UNIT_MISMATCH = "E0212":
"The unit does not fit what is measured here: a density needs kg/m^3, a time s, an angle deg or rad. Inside shapes
only lengths and angles are meaningful.";
BARE_OVERRIDE = "W0214":
"The file writes the value of this param in a unit such as mm, and a number without one is given, as by -D. Numbers without a unit
are in SI units everywhere, so `-D d=8` is 8 m. Write the unit: `-D d=8mm`, or `-D d=8m` if metres are meant. Where the range of
the param holds the number in one of both units only, nothing is asked.";
ATTRIBUTE = "E0213":
"An attribute stands before a solid and says what is wanted of it beside its shape. There is one: `@tolerance(1e-6)`,
the largest |computed ω − exact ω| that is accepted, over the box of the scene that uses the solid or, without a scene,
over the solid's bounds and half their longest side around them. The cheapest program that is certified to keep it is
then used for values of ω; `rfm check` prints which one.

    @tolerance(1e-6)
    solid post = x² + y² <= 0.25 and 0 <= z <= 1";
OUTLINE = "E0215":
"The corners of a polygon do not enclose an area: two edges cross or touch, a corner stands twice, or the outline turns
back on itself. List the corners along the outline, each once, in either direction. Or the two outlines of a loft lie beside each
other: between them nothing would be left.

    rfm 1
    solid arrow = polygon([[0, 0], [2, 1], [0, 2], [0.5, 1]]).extrude(0, 1)";
FILE = "E0216":
"A file that this file names cannot be read, or is not what it is read as: a list of points, a map of heights. Paths begin
at the folder of the file in which they are written, and lead to files in the folder of the file that is compiled or below
it; --allow-outside lets them lead anywhere. A text that a program hands over has no folder: the program says where files
come from.

    rfm 1
    import \"parts/chess.rfm\" as chess
    solid piece = chess.pawn";
MESH = "E0217":
"A file of triangles must enclose a solid: each edge belongs to two triangles, which are wound the same way, and no part of
the surface lies within the solid or on another part of it. STL, OBJ and PLY files are read, as text or as bytes; corners
are the same only if their coordinates are, to the last digit. Bodies that overlap belong into files of their own, joined
by `or`. The message says what is wrong, and where.

    rfm 1
    solid part = mesh(\"part.stl\", 1 mm)";
IMPORT = "E0218":
"An `import` takes the solids, functions, params and names of another file of this language. Files cannot import one
another in a circle, and a mesh is read by `mesh(…)` instead.";
NO_FORMULA = "E0219":
"`rfm build` writes formulas, and a mesh or a height map from a file is looked up in a table that is no formula. Leave the
part out, or write it as a formula: a ground by `x`, `y` and `sin`, a body by the solids of the language. `rfm mesh` writes
the surface of the whole solid for other programs, and programs in Rust, C and Python load the file itself through the
library: they have ω, ∇ω and contacts of every solid.

    rfm 1
    solid part = mesh(\"part.stl\", 1 mm)";
COMMAND = "E0220":
"A command was asked for something that it cannot do with the file: there is no such file, it cannot be read, or a flag names a
solid that it does not have. People read the reason alone, and commands end with 2. Programs that asked for messages, by --json or
--message-format, find it among them under this code; it is about no place in the file, so its place is the beginning.";
SCENE_KEY = "E0301":
"The scene does not know this key, or this value of it, at this place. What it knows:

    scene name {
      box      { min: [0, 0, 0], max: [3, 3, 3], restitution: 0.5 }
      fluid water {
        shape: ball([1.5, 1.5, 2], 0.5), fill: below, particles: 10000, density: 998.29 kg/m^3, mass: 0.02 kg,
        viscosity: 3.5 Pa·s, surface_tension: 0.0728 N/m, support_radius: 0.1 m, velocity: [0, 0, -1 m/s],
        jitter: 0, seed: 1
      }
      obstacle { solid: post, restitution: 0.5 }
      gravity: [0, 0, -9.81 m/s^2]
      method: paper
      run      { dt: 2 ms, until: 5 s, save_every: 0.05 s, checkpoint_every: 0.5 s }
      probe gauge { height: [1, 0.5], every: 10 ms }
      probe depth { pressure: [1, 0.5, 0.1] }         # velocity: [1, 0.5, 0.1]
      probe load  { force: post, about: [1, 1, 0], from: 1 s, known: [0, 0, 9 N] }   # `about` is for the torque
      probe drain { flux { point: [1, 0, 0], normal: [1, 0, 0] } }
      probe sum   { energy: water }                   # or audit: water
      tolerance: 1e-6
    }

`fill` is `below` or `middle`; without `particles` the shape is filled, without `dt` a stable step is derived.
`spacing` may stand in place of `mass`. There are also `container { solid: … }`, `walls: no_slip`, `truth { … }` and
`solver { precision: f64 }`. `from` in a probe asks for the mean of its samples from that time on, with its standard error;
`known` states what it is to be, and the run says how far off it is. Each method has keys of its own: `rfm explain --methods` lists them.";
SCENE_MISSING = "E0302":
"The scene lacks something without which it cannot be run: a box with its far corner `max`, a fluid with a `shape`, or
the `solid` of an obstacle. All other keys have defaults. Only the `sound_speed` of `method: wcsph` has none where the fluid rests
at the start and no gravity, velocity or moving obstacle says how fast it will be.";
SCENE_REPEATED = "E0303":
"A key or block stands twice where it may stand once.";
SCENE_NO_ROOM = "E0304":
"The fluid cannot be put where the scene says: its shape has too little room for the particles that are asked for, is
empty or far too large, or its formula has no value somewhere. The message says which.";
UNUSED = "W0401":
"The item, the parameter of a function or the variable of a fold is never used. Remove it, or start its name with `_` to keep
it silently. A fold whose variable is not used has many equal members.";
EMPTY_SOLID = "W0402":
"Interval arithmetic proves that ω is nowhere positive: the solid is empty, its mesh has no triangles and nothing ever
collides with it. If the message says that the solid *may be* empty, that is not proven: `check` found no part of it on
its grid, nor along lines, and a thread of 5 µm whose length of 1 lacks its unit mm is met by few of them.";
UNBOUNDED_SOLID = "W0403":
"The solid could not be proven to end towards the sides that the message names: it cannot be meshed over its own
bounds. If one member of a union is to blame, the message marks it. Intersect it with a box, or mesh it over a scene's
box.";
FOLD_OF_ONE = "W0404":
"`any` or `all` over a range with one member is likely a slip: the range `a..b` holds a, a+1, … b−1.";
STRICT_COMPARISON = "W0405":
"`<` means the same as `<=` here: a comparison builds a field whose zero is the surface itself.";
OVERFLOW = "W0406":
"A chain of `or` or `and` written by hand, one operation inside the next, can double ω with every member: after about a
thousand equal members it is larger than the largest number, 1.8e308, and becomes infinite. Its sign stays right; its
value and gradient are lost. Written as one chain `a or b or c or …`, or as a fold `any i in 0..n: …`, it is evaluated
as a balanced tree, in which ω grows with the logarithm of the number of members.";
TOLERANCE = "E0407":
"No program of the solid is certified to keep the tolerance that is asked for: the bound of |computed ω − exact ω| over
the box is larger in every arithmetic that there is, single and double precision. The message names the smallest bound
that can be had. If there is none at all, a formula in the box may divide by zero, take the root of a negative number
or leave the range of numbers; or the solid has neither bounds nor a scene with a box.";
THIN_PARTS = "W0408":
"Parts of the solid, or gaps in it, are thinner than two cells of the usual grid, and pass between its nodes or beside
its triangles: a mesh with as many cells does not show all of them. The message says where the thinnest is and how many
cells would show it. With these the volume is measured if they are at most 512 and the budget allows it; if not, it is
that of what the usual grid shows. (That of a mesh alone is the sum over its triangles, whatever their size.) Each cell
that is counted holds a point of a surface which the grid does not know, so surfaces that only touch, as in `a and not a`, do not count. Edges of wedges and tips of cones
count as well: every grid shows them a little blunt. If there is nothing else the message says so, and the volume is
measured all the same.";
LARGE_ANGLE = "W0409":
"Angles are radians unless a unit says otherwise, and this one is more than a whole turn. Write `45 deg` for degrees, or
`45 rad` if radians are meant. A rate as in `.rotate_z(10*t)` is in radians per second, and is asked about only if it is
a number that is usual in degrees, such as 45 or 360. So is a number that no angle of `atan2`, `atan`, `asin` or `acos`
reaches, as in `atan2(y, x) <= 45`.";
CONSTANT_SOLID = "W0410":
"The solid does not depend on x, y or z: it is all of space if its value is positive, and empty otherwise. A solid is an
inequality such as `x² + y² <= 1 and 0 <= z <= 1`, or a standard solid such as `sphere(1)`. The same holds for an operand of
`and`, `or` or `\\` that is a number: `x <= 1 or 2` is all of space.";
SHAPES_AS_NUMBERS = "W0411":
"`+`, `-`, `*` and `/` work on the values of ω, and the result is rarely a shape that someone means. Shapes are joined by
`a or b`, cut by `a and b`, and taken away by `a \\ b`, and many of them are joined by `any`, not by `sum`. Comparisons are shapes
too. Where the values are meant, give one of them a name with `let`.";
UNDEFINED_VALUE = "W0412":
"A divisor is zero wherever it is evaluated, or a function of constants has no value, as `sqrt(-1)`, so the result is infinite or
no number at all. A shape with a number that is none has no inside.";
NO_SECTION = "W0413":
"The plane of a slice does not meet the solid, or its section is thinner than a pixel: the picture shows the outside only.
The message says between which coordinates the solid lies.";
SECTION_IN_FACE = "W0414":
"The plane of a slice lies within a face of the solid, where ω is zero all over and rounding would decide what is inside. The
picture shows the section just outside of that face; a plane a little further in shows the other side.";
IDLE_OPERAND = "W0415":
"It is proven that the solid has the same points without this operand of `and` or `or`: it lies within another member of the
union, or around all that it is to cut. That is often a slip in a size or a place. Only the shape counts here: the values of ω
do change. The proof holds for the present values of the params. Of two operands that are the same formula the second one is
named; where a function or a fold has made them, they are not looked at.

    rfm 1
    solid ball = sphere(1) or sphere(0.5)            # the second one lies within the first";
UNEVEN_OPERANDS = "W0416":
"The gradients of two operands that are joined differ by a factor of 1000 or more at the surface. The shape is right, but near
the edge where they meet ω follows the flat one alone: its value says little of the distance, f32 and certified programs
lose digits, and interpolation between the nodes of a grid is poor. `normalise(e)` divides a formula by the size of its
gradient, and lengths in place of their powers have gradients near 1: `r - sqrt(x² + y²)` instead of `r² - x² - y²`.

    rfm 1
    solid peg = normalise(1e4*(0.01 - x² - y²)) and 0 <= z <= 1";
JUMP = "W0417":
"At the surface ω jumps from one sign to the other instead of passing through zero: the border of an `if`, a step of
`floor`, `mod` or `round`, or a pole of a divisor lies there. No distance, normal or smooth mesh follows from such a surface,
and particles may pass it. Let both values agree where they meet, move the border away from the surface, or cut the shape by
`and` at the border.

    rfm 1
    solid step = box([-1, -1, 0], [1, 1, 2]) and (if x <= 0 then 1 - z else 0.5 - z)";
SINGULAR = "W0418":
"Outside of the solid, in the scene that has it as an obstacle or close to it, ω has no value: a divisor is zero there, or a
root or a logarithm is taken of a negative number. What comes near is neither inside nor outside, and a run stops there. Keep
the formula away from that place by `max`, or choose another one: `if x > 0 then ln(max(x, 1e-9)) else -20`.";
NO_EDGE = "W0419":
"`.round(radius)` makes arcs of the edges at which the parts of a shape are joined by `and`, `or` and `\\`. This shape is one
formula, or its parts are joined further inside: `min`, `max` and `blend` keep their edges, and `.taper` makes one formula of what it
narrows. Round the shape before that.

    rfm 1
    solid tablet = box().round(0.1).taper(1, 0.5)";
SEAM = "W0420":
"ω is zero on a line within the solid. Values there count as outside, distances and contacts know a surface there, and a mesh may
have a hole. Only the axes of the scene and the middle axes of the solid are looked at. Most often an outline that is turned
about an axis has an edge on it: draw it beyond the axis, which hides that edge.

    rfm 1
    solid can = polygon([[-0.1, 0], [0.5, 0], [0.5, 1], [-0.1, 1]]).revolve()

The same is told if ω is zero throughout a part of space, at all points that were tried: `abs(z) <= z` is the field z − |z|, which is
0 for z > 0, and nothing is inside there. Write `z >= 0`.";
REVERSED_CHAIN = "W0421":
"`a <= e <= b` is the layer between a and b, as (e − a)·(b − e), whichever of them is greater. Where a is greater than b no
place fulfils both comparisons, so the ends are likely exchanged. If the ends depend on the place, each may be the greater one
somewhere: `x <= y <= z` holds where `z <= y <= x` does as well, which is twice as much as is most often meant. `x <= y and y <= z`
has one order only. It is told of where a point of the solid is found that belongs to it by the other order alone.

    rfm 1
    param low = 2 in 0 .. 5
    solid slab = low <= z <= 1 and x^2 + y^2 <= 1";
NOTHING_LEFT = "W0422":
"`.round` takes a radius from the corners of a shape, a negative `.offset` moves its faces inwards, and `.shell` leaves a wall of
its thickness. It is proven that nothing is left of the shape, or of the hollow within a shell, because it is nowhere twice as
thick as that length.

    rfm 1
    solid plate = box([0, 0, 0], [4, 3, 0.2]).round(0.5)     # 0.2 high: a radius below 0.1 leaves some of it";
SPINDLE = "W0423":
"`torus(R, r)` has a ring with the radius R and a section with the radius r. If r is larger than R it cuts itself along the axis:
it has no hole, and looks like an apple. Most often the two are exchanged: `torus(1, 0.2)` is a slender ring.";
THIN_FOR_EDGES = "W0424":
"`.round(r)` makes arcs of the edges of a shape, and a part that is thinner than 2r has no room for two of them. It ends
in the middle of its thickness T by r − √(r² − (r − T/2)²) short of where it ended. A part that is so thin in one
direction keeps its faces; one that is so thin in all directions keeps none and becomes smaller: a cube of 1 m with
`.round(0.6)` is 0.97 m wide, with `.round(0.8)` 0.76 m.

    rfm 1
    solid plate = box([0, 0, 0], [4, 3, 0.2]).round(0.15)    # 0.2 thick: a radius of 0.1 keeps its length";
ANGLE_AS_LENGTH = "W0425":
"A coordinate is a length in metres, and the angle that it is compared with is a number of radians: `x <= 10 deg` is `x <= 0.17`.
Where the angle of a place is meant, it is `atan2(y, x)` about the z axis. In a shape that `.at` maps, coordinates may be angles.

    rfm 1
    solid wedge = x <= 10 deg and box()                      # atan2(y, x) <= 10 deg";
LOFT_OF_SOLIDS = "W0426":
"`a.loft(b, z0, z1)` leads from the outline a at z0 to the outline b at z1. Outlines are fields of x and y, which go on along z
without an end. Of a solid it takes the values at each height, which also tell of its ends, so that what comes out is most often
smaller than what was meant. It is right if the solid reaches far below z0 and far above z1.

    rfm 1
    solid a = sphere(1).loft(sphere(2), 0, 1)                # sphere(1).at([x, y, 0]).loft(sphere(2).at([x, y, 0]), 0, 1)";
BARE_RANGE = "W0427":
"The value of the param has a unit such as mm or deg, and the range has none. Numbers without a unit are in SI units
everywhere, so that `45 deg in 0 .. 90` reaches to 90 radians, which are 14 turns. Write the unit at both ends; zero needs none.

    rfm 1
    param alpha = 45 deg in 0 .. 90                          # 45 deg in 0 .. 90 deg
    solid s = box().rotate_z(alpha)";
LOST_ENDS = "W0428":
"`.bend(radius)` makes a circle of the x axis from −π·radius to π·radius, around the line at z = radius. What the shape has beyond
these ends, or above that line, is left out, and where it is cut off ω may jump. The message says how much of the shape that is, by
samples. A larger radius has room for it; so has a smaller shape, or one that is moved to the middle first, as by
`.move([-0.5, 0, 0])`.

    rfm 1
    solid hook = box([0, 0, 0], [1, 1, 1]).bend(0.05)        # a radius of 1 has room for it";
LENGTH_AS_AREA = "W0429":
"Squares of coordinates are an area in square metres, and what they are compared with has the unit of a length:
`x^2 + y^2 <= 500 mm` is a circle with the radius √0.5 m, not 500 mm. Square the radius, too, or compare `hypot(x, y)` with it.

    rfm 1
    solid post = x^2 + y^2 <= 500 mm and 0 <= z <= 1         # x^2 + y^2 <= (500 mm)^2";
REPLACED = "W0430":
"The file defines a function with the name of a standard solid or map. From there on the name means the new one in this file, also where it
is called as a method; the standard solids themselves do not change. If that is what is meant, another name says it better.

    rfm 1
    fn sphere(r) = box([-r, -r, -r], [r, r, r])              # fn cube(r) = …
    solid part = sphere(1)";
FLUID_IN_OBSTACLE = "W0501":
"Part of the fluid's shape lies inside an obstacle, or outside the box or the container. Those particles are carved off before the
run starts. `rfm run` counts them. `rfm check` and editors estimate by samples how much of the shape is taken, and tell of it where
that is more than a quarter.";
FLUID_OUTSIDE_BOX = "W0504":
"Part of the fluid's shape lies outside the scene's box. The fluid is filled into the part within the box, so there is
less of it than the shape says. Make the box larger, move the shape, or cut the shape where the box ends.";
THIN_FOR_PARTICLES = "W0508":
"A gap of an obstacle is thinner than two spacings of the particles, or a wall thinner than half of one. Particles keep
half a spacing from each face and fill what is left in whole layers: under a head of thirty spacings a gap of 2 spacings
holds 93 % of what it should, one of 1.5 spacings 66 %, one of 1 spacing 51 %, and a thinner one nothing. Through such a
wall the fluid on one side feels that on the other more than its own second neighbours. Of a wall whose load a probe
measures it is told if it is thinner than one and a half spacings: kernels before it reach beyond it, and where nothing
is behind it the fluid is pressed against it harder than it should be. The message says how thin it is, where, and what
spacing is small enough. Parts that extend over less than two spacings, and the tips of wedges, do not count.

An obstacle that is smaller than a particle as a whole, or a rod thinner than half a particle, is told of too: particles flow past
it almost as if it were not there. The spacing may follow from the number of particles, 10 000 unless it is stated.";
DRY_WALL = "W0518":
"The fluid's shape tapers off between an obstacle and another wall, and becomes thinner than a particle: below a cylinder that
lies on a floor, in a narrow wedge, or in a gap. Particles keep half a spacing from walls, so such places stay empty, nothing
presses on the walls there, and water at rest flows into them at the start. The message says how much of the load of a fluid at
rest is missing at least, the force of that part, and the deepest place where it is. What lifts a body that lies on a
floor is the little by which its load from below is the greater, so a few per cent of the load may be half of the lift. A quarter
of the spacing leaves half of it where walls touch, and a quarter in a wedge; a gap needs a spacing that fits into it. Scenes with
more than some millions of particles are not looked at.";
TENSION_STIRS = "W0509":
"The surface tension of a divergence-free fluid (dfsph) is a force by normals and curvature. It is not the gradient of an
energy, and gives particles at the surface a motion that only viscosity ends. The message says how fast that is at most in a
drop at rest, and it is told where that is not small against the speeds of the scene. More viscosity calms it, `method: wcsph`
damps it, and with smaller particles it is slower.";
FRAMES = "W0505":
"Frames are saved so rarely that none lies between the start and the end of the run, or so often that they fill a disk.
`save_every` is the simulated time between two of them, `until` that of the whole run. The same is told of checkpoints and of the
samples of a probe that the run ends before.";
TOO_MUCH = "W0506":
"The run needs more memory or room on the disk than there is now. Fewer particles, a longer `save_every`, or
--no-frames make it smaller.";
LONG_STEP = "W0503":
"The time step is longer than what is stable when particles fall through the whole box. The run may still go well if
they never become so fast; without `dt` a stable step is derived.";
ENERGY_GREW = "W0511":
"The run's energy rose by more than 1 % above what it had at the start and gravity's work since then; where walls move, above
what was left of that and their work, by more than 1 % of the greatest energy so far; or, where no wall moves, by more than 0.2 % of
it and a quarter of the greatest energy of motion, as a low wave that grows does (of a fluid at rest, which hardly moves, that is not
told). With `gradients: differences` the work of walls is known to a tenth, so as much is allowed for, and 5 % besides.

No fluid gains energy so: the method made it of its errors. What moves faster or higher than it could is wrong from then on. More particles, more `artificial_viscosity`
(wcsph), or the other method may help; `energy_excess` in the summary has the largest value, and the probe `audit` shows when it
arose. A run whose energy doubles stops. Where walls move, it stops when what came from nowhere stays, for 64 steps, above the energy
at the start and all that walls gave and took since.";
VOLUME_CHANGED = "W0512":
"The places of the particles take up 2 % more or less room than at the start. Where particles crowd, the fluid has lost
volume: levels are too low and what hits them comes too late. `volume_change` in the summary has the largest value. With `wcsph` a
higher `sound_speed` helps where pressures are higher than was foreseen, as in a thick fluid that is pressed through a narrow place.";
COMPRESSED = "W0513":
"By the places of its particles the fluid is compressed, on average, more than ten times as much as the method is to allow.
Look at `compression_p99` in the summary as well: large values mean that particles crowd in a few places, most often at
walls that the flow hits.";
DRAG = "W0514":
"A probe takes the mean of the force on a body that moves meanwhile, and the method takes pressures in pairs. Rows of particles
under pressure resist being sheared, as a solid does a little, and what damps their noise acts as a viscosity: a ball of six
spacings across that moves through water felt six times the drag that it should, and a fifth more than its buoyancy. Forces on
bodies at rest in a fluid at rest are right, also on those that have come to rest before the mean begins (`from`), and so are
impacts, the force on a vessel that moves with its fluid, and the drag of a fluid whose own viscosity is greater than that which
damps noise. With `method: wcsph` and `gradients: differences` the drag of that ball was right.";
MANY_STEPS = "W0515":
"The run takes so many steps that it hardly ends: with a thousand particles a hundred million of them take half a day. Most
often a number is in another unit than was meant. A `dt` may be left out; steps are as long as speeds of sound and of the fluid,
viscosity, surface tension and gravity allow, and end at each frame (`save_every`).";
PROBE_IN_BODY = "W0516":
"A probe of a pressure or a velocity lies in an obstacle at rest or outside the container, where there is never any fluid. What
it tells is the mean of the particles that are near enough, beside the obstacle, or NaN if there are none.";
RUN_HAS_HOLES = "W0517":
"A run goes on with --resume in a folder where files of its past are missing or were cut: frames, or samples in the table of a
probe. The state itself is whole, because it comes from a checkpoint, so all that follows is right. What was lost stays lost:
`particles.pvd` goes without those frames, and a mean over a table with a hole is not the mean of the run. The message says
what is missing. `--force` in place of --resume computes the run anew.";
OUT_OF_REACH = "W0519":
"An obstacle has no place where fluid could ever be: it lies outside the box, or in the wall of the container. If its
face lies on that of the box or of the container, as a lid on a vessel, then both walls are there, and each has its part
in what the fluid feels: a lid that moves takes a fluid that sticks to both along at half its speed, because the other
wall at the same place is at rest. Let the box or the container reach beyond the obstacle, so that this alone is the
wall there.";
SLOW_SOUND = "W0520":
"`sound_speed` is stated, and the fluid may become faster than a fifth of it; or in a run, more than one particle in a thousand was
faster than 0.4 of the speed of sound, stated or derived, as seen from the fluid as a whole: as where a piston presses water through a
hole. A weakly compressible fluid changes its density
by about the square of its speed over that of sound: 1 % at a tenth, 5 % at more than a fifth. Beyond, it is a gas, and what is
found is not that of a liquid. Left out, the speed of sound is ten times the greatest expected speed u, or with surface tension σ
ten times √(u² + σ/ρa), with the spacing a, or in a creeping flow 10√(10νu/a).";
NOTHING_COMPARED = "W0521":
"`from` in the block `truth` says from when on its solution holds, and the run ends before. So there is no frame at which the
flow is compared with it.";
FLUID_OF_TIME = "W0522":
"The fluid's `shape` says where the fluid is at the start. Its particles are placed once, at t = 0, so a formula with the time `t`
has no effect on them later, and the same holds of its `velocity`. Obstacles and the container may move; a fluid gets its motion from its `velocity`, from gravity and
from them.";
CLAMPED = "W0523":
"In a fluid that fills all its room, wcsph takes gradients by differences and keeps negative pressures, because only
differences of pressure matter there. `shifting: 0` and `gradients: pairs` rule out the differences, and with pairs
negative pressures are cut off at zero unless the scene says `negative_pressure: keep`. Waves of sound and flows around
bodies come out wrong then. Stating `negative_pressure` either way silences the warning.";
NO_FRICTION = "W0524":
"With the paper's method walls act on the positions and velocities of particles that reach them, and have no viscous
force on the fluid. `walls: no_slip`, or that of an obstacle, changes nothing then: oil between two plates falls freely.
`friction` and `restitution` act where a particle hits a wall. The other methods know `no_slip`.";
PICTURE_ASIDE = "W0525":
"`look_at` in the block `picture` is the place in the middle of the pictures, in metres. It lies outside of the box, where nothing
is drawn, so pictures may be empty. Left out, it is the middle of the box; `zoom` makes what is there larger.";
HEAVY_FLUID = "W0526":
"No liquid is so dense, or so light: hydrogen has 71 kg/m³, water 998, mercury 13 546, and molten metals have up to 20 000. Most
often another unit was meant, and a light fluid with a unit, as in `1.2 kg/m^3`, is not asked about:
a bare number is in kg/m³, so water is `1000` or `1 g/cm^3`. Forces, pressures and loads grow with the density.";
CROWDED = "W0527":
"Sums over neighbours are made for particles that stand about a spacing apart in all directions. A fluid that is pressed flat, or
drawn out, in less time than its particles need to mix keeps the rows that it began with: close to each other one way, and far
the other way. The sums then say a greater density than there is, and the pressure grows until the rows stand so far apart that the
sums are right: volume and compression, which are found by the same sums, show nothing, but pressures and forces are too large.
Plates that pressed a layer of ten spacings to four within 6 ms bore three times the force; pressed to three, the layer had 2.9 times
the energy that it should have. There finer particles, a jitter and shifting hardly help; a slower motion does, in which particles
have the time to change places. For a fluid that is drawn out slowly `shifting: 1` helps, and with `wcsph` `gradients: differences`.";
ODD_QUANTITY = "W0529":
"A key of the scene has a value that hardly anyone means: a surface tension that no liquid has, the gravity of the Earth as a
number of millimetres, or a `support_radius` far larger than the one of the method. Most often it is in another unit: a number
without a unit is in SI units. `support_radius` says how far sums over neighbours reach; left out, it follows from the spacing of
the particles, so it need hardly ever be stated.";
OBSTACLE_FILLS_BOX = "E0502":
"The obstacle covers every place where fluid was to be put: nothing is left to simulate.";
}
