//! The layout of single constructs. Whole files are tested by the examples and by random programs.

use super::{Spelling, format};
use crate::diagnostic::Source;

#[track_caller]
fn formatted(text: &str, spelling: Spelling) -> String {
    let out = format(&Source::file("t.rfm", format!("rfm 1\n{text}")), spelling).unwrap();
    let again = format(&Source::file("t.rfm", out.clone()), spelling).unwrap();
    assert_eq!(out, again, "not the same when formatted again");
    out.strip_prefix("rfm 1\n").unwrap().to_string()
}

#[track_caller]
fn check(text: &str, expected: &str) {
    assert_eq!(formatted(text, Spelling::Written), expected);
}

/// The layout of the text is the text.
#[track_caller]
fn keeps(text: &str) {
    check(text, text);
}

#[test]
fn blanks_stand_where_they_belong() {
    check("let a=1+2*x\n", "let a = 1 + 2*x\n");
    check("let a = 2 *x^ 2 and  not( y<=1 )\n", "let a = 2 * x^2 and not (y <= 1)\n");
    check(
        "fn f( a,b=1 )=a .x+[ 1,2 ][ 0 ]\n",
        "fn f(a, b = 1) = a.x + [1, 2] [0]\n".replace("] [", "][").as_str(),
    );
    check(
        "solid s=any i in 0 .. 6:ball( [i,0,0],r=-1 ) . move( [0,0,1] )\n",
        "solid s = any i in 0..6: ball([i, 0, 0], r = -1).move([0, 0, 1])\n",
    );
    check(
        "let a=if(x<=1)then-1 else if y>=2 then[1,2].x else not z<=1\n",
        "let a = if (x <= 1) then -1 else if y >= 2 then [1, 2].x else not z <= 1\n",
    );
    check("param p=1 in 0..2\"doc\"\n", "param p = 1 in 0 .. 2  \"doc\"\n");
    check("scene s{box{max:[1,1,1]},run{}}\n", "scene s { box { max: [1, 1, 1] }, run {} }\n");
}

#[test]
fn units_and_numbers_keep_their_value() {
    check("let a = 3mm + 2. + .5 + 1e−3 + 90 °\n", "let a = 3 mm + 2 + 0.5 + 1e-3 + 90°\n");
    // without the blank it would be a length times itself, or another unit
    check("let a = 3 m ² / s\n", "let a = 3 m ² / s\n");
    check("let s = 2\nlet a = 3 m / s\n", "let s = 2\nlet a = 3 m / s\n");
    check("let s = 2\nlet a = (3 m)/ s\n", "let s = 2\nlet a = (3 m) / s\n");
    check("solid s = any i in 0. .. .5: x\n", "solid s = any i in 0..0.5: x\n");
}

#[test]
fn pasted_signs_and_slips_are_spelt_as_in_the_language() {
    check(
        "solid s = x·2 − 1 =< 3 && y => 1 || ! z ≤ 1\n",
        "solid s = x*2 - 1 <= 3 and y >= 1 or not z ≤ 1\n",
    );
    assert_eq!(
        formatted("solid s = x^2 <= 1 and not y² >= 2 \\ z^-2^2\n", Spelling::Unicode),
        "solid s = x² ≤ 1 ∧ ¬y² ≥ 2 ∖ z^-2^2\n"
    );
    assert_eq!(
        formatted("solid s = x² ≤ 1 ∧ ¬y²^3 ≥ x²² ∨ 2^x² ≥ 2^-y³ ∖ [x]².x\n", Spelling::Ascii),
        "solid s = x^2 <= 1 and not (y^2)^3 >= (x^2)^2 or 2^x^2 >= 2^-(y^3) \\ ([x]^2).x\n"
    );
}

#[test]
fn hand_made_columns_stay() {
    keeps("param rise  = 0.25  \"height\"\nparam steps = 8 in 1 .. 50\nparam width = 2     \"width\"\n");
    keeps("let a  = 1    # one\nlet bc = 2    # two\n              # and more\nlet d  = 100  # three\n");
    keeps(
        "scene s {\n  box      { max: [1, 1, 1] }\n  fluid water {\n    shape: x\n  }\n  obstacle { solid: post }\n}\n",
    );
    // nothing is in the same column
    check("let a    = 1       # one\n", "let a = 1  # one\n");
    // what follows a comma or a sign without a blank stands below something else by chance
    check("param   a=1\nfn f(x1,y1=2)=x1\n", "param a = 1\nfn f(x1, y1 = 2) = x1\n");
    check("let    a=1\nsolid s=x\n", "let a = 1\nsolid s = x\n");
    // lines of different depth are moved apart
    check(
        "param r=1\nlet   a=2\nscene q{box{max:[1,1,1]}\nfluid w{shape:x}}\n",
        "param r = 1\nlet   a = 2\nscene q { box { max: [1, 1, 1] }\n  fluid w { shape: x } }\n",
    );
    // the end of a range and an operand of `and` are no column
    check(
        "param longer = 2 in 0 .. 3\nsolid s=sphere( 1 )  &&  z>=0\n",
        "param longer = 2 in 0 .. 3\nsolid s = sphere(1) and z >= 0\n",
    );
    // all move together
    check("let a  =1\nlet bc =2 + 3\nlet d  =x\n", "let a  = 1\nlet bc = 2 + 3\nlet d  = x\n");
}

#[test]
fn wrapped_lines_stay_under_what_they_stand_under() {
    keeps(
        "solid s = (x <= 1 and y <= 2)  # body\n       or (y <= 1              # collar\n           or z <= 2)          # head\n",
    );
    keeps("fn f(a) =\n  a + 1\n");
    check("fn f(a) =\n      a + 1\n", "fn f(a) =\n  a + 1\n");
    check("let a = x and\ny\n", "let a = x and\n  y\n");
    check("let a=f(x,\n        y)\n", "let a = f(x,\n          y)\n");
    check("let a = [\n[1, 0],\n      [2, 0],\n      ]\n", "let a = [\n  [1, 0],\n  [2, 0],\n]\n");
    check(
        "scene s {\nbox {\nmax: [1,\n1, 1]\n}\n# end\n}\n",
        "scene s {\n  box {\n    max: [1,\n      1, 1]\n  }\n  # end\n}\n",
    );
}

#[test]
fn lines_end_where_the_writer_ended_them() {
    check("\n\n\nlet a = 1\n\n\n\nlet b = 2 let c = 3\n\n", "\nlet a = 1\n\nlet b = 2\nlet c = 3\n");
    check("scene s\n{\n\n  run { until: 1\n  , dt: 1 }\n\n}\n", "scene s {\n  run { until: 1, dt: 1 }\n}\n");
    check("@tolerance( 1 ) solid s=x\n", "@tolerance(1)\nsolid s = x\n");
    let windows = format(&Source::file("t.rfm", "rfm 1\r\nlet a=1\r\n"), Spelling::Written).unwrap();
    assert_eq!(windows, "rfm 1\r\nlet a = 1\r\n");
}

#[test]
fn comments_and_the_version_have_their_place() {
    check(
        "let a = x # one \n  and y\n    # two\n let b = 1",
        "let a = x  # one\n  and y\n# two\nlet b = 1\n",
    );
    let added = format(&Source::file("t.rfm", "# a title\n\nlet a = 1"), Spelling::Written).unwrap();
    assert_eq!(added, "# a title\n\nrfm 1\n\nlet a = 1\n");
    let only = format(&Source::file("t.rfm", "# a title"), Spelling::Written).unwrap();
    assert_eq!(only, "# a title\nrfm 1\n");
}

#[test]
fn a_file_with_a_mistake_has_no_layout() {
    let messages = format(&Source::file("t.rfm", "rfm 1\nlet a = = 1"), Spelling::Written).unwrap_err();
    assert_eq!(messages.len(), 1);
}
