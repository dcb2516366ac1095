//! Light: one lamp over the viewer's left shoulder, and ambient light.
//!
//! Normals are unit vectors in the camera's frame: x to the right, y up, z towards the eye.

use super::Rgb;

/// The material of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Material {
    /// An opaque warm grey: obstacles.
    #[default]
    Stone,
    /// An obstacle through which the fluid is seen.
    Glass,
    /// The surface of a fluid that hides the things in it.
    Water,
    /// The surface of a fluid through which obstacles and particles are seen.
    ClearWater,
}

impl Material {
    /// Whether things behind it are seen.
    pub(super) fn is_clear(self) -> bool {
        match self {
            Self::Stone | Self::Water => false,
            Self::Glass | Self::ClearWater => true,
        }
    }
}

/// A colour and its opacity, 255 of which hides all.
pub type Veil = [u8; 4];

/// The unit vector towards the lamp.
const LAMP: [f32; 3] = [-0.452_29, 0.678_434, 0.578_931];
/// The unit vector half-way between the lamp and the eye. Spheres gleam where their normal is this.
const GLEAM: [f32; 3] = [-0.254_519, 0.381_778, 0.888_519];
const AMBIENT: f32 = 0.52;
const DIFFUSE: f32 = 0.58;

/// The colour of all obstacles: a neutral warm grey.
pub const OBSTACLE: Rgb = [203, 195, 184];
const STONE: [f32; 3] = [OBSTACLE[0] as f32, OBSTACLE[1] as f32, OBSTACLE[2] as f32];

/// The colour of faces that a cut has opened: that of brick.
const SECTION: [f32; 3] = [214.0, 170.0, 146.0];

/// The colour of fluid that a cut has opened.
const WATER_SECTION: [f32; 3] = [142.0, 183.0, 217.0];

/// The colour of water.
const WATER: [f32; 3] = [72.0, 138.0, 196.0];

/// The colour of a point of an opaque surface. A tint replaces the colour of the material.
pub fn solid(material: Material, tint: Option<[f32; 3]>, normal: [f32; 3]) -> Rgb {
    match material {
        Material::Stone | Material::Glass => stone(tint.unwrap_or(STONE), normal),
        Material::Water | Material::ClearWater => water(tint.unwrap_or(WATER), normal),
    }
}

/// The colour and the opacity of a point of a clear surface. Clear things hide more where they are seen at a
/// flat angle, so their outline shows and their middle does not.
pub fn veil(material: Material, tint: Option<[f32; 3]>, normal: [f32; 3]) -> Veil {
    let flat = 1.0 - normal[2].clamp(0.0, 1.0);
    let (least, rim) = match material {
        Material::Stone | Material::Water => (1.0, 0.0),
        Material::Glass => (0.13, 0.62 * flat * flat * flat),
        Material::ClearWater => (0.42, 0.46 * flat * flat),
    };
    let gleam = power_16(dot(normal, GLEAM));
    let opacity = (least + rim + 0.35 * gleam).min(1.0);
    let [r, g, b] = solid(material, tint, normal);
    [r, g, b, byte(255.0 * opacity)]
}

/// The colour of a point of the fluid's surface.
fn water(colour: [f32; 3], normal: [f32; 3]) -> Rgb {
    let light = 0.56 + 0.08 * normal[1] + 0.5 * dot(normal, LAMP).max(0.0);
    let gleam = 70.0 * power_16(power_2(dot(normal, GLEAM)));
    colour.map(|channel| byte(channel * light + gleam))
}

/// The colour of a point of the obstacle's surface.
fn stone(colour: [f32; 3], normal: [f32; 3]) -> Rgb {
    // some light depends on the height of the normal, so that undersides keep their shape
    let light = AMBIENT + 0.06 * normal[1] + DIFFUSE * dot(normal, LAMP).max(0.0);
    let gleam = 14.0 * power_16(dot(normal, GLEAM));
    colour.map(|channel| byte(channel * light + gleam))
}

/// The colour of a face that a cut has opened. It is flat, so that it does not look like a surface of the
/// obstacle.
pub fn section(material: Material, normal: [f32; 3]) -> Rgb {
    let light = 0.78 + 0.22 * dot(normal, LAMP).max(0.0);
    let colour = match material {
        Material::Stone | Material::Glass => SECTION,
        Material::Water | Material::ClearWater => WATER_SECTION,
    };
    colour.map(|channel| byte(channel * light))
}

/// The colour of a point of a particle. The rim is darker, so that neighbours of one colour can be
/// distinguished.
pub fn ball(colour: [f32; 3], normal: [f32; 3]) -> Rgb {
    let rim = (0.45 + 1.1 * normal[2]).min(1.0);
    let light = (0.56 + 0.52 * dot(normal, LAMP).max(0.0)) * rim;
    let gleam = 60.0 * power_16(dot(normal, GLEAM));
    colour.map(|channel| byte(channel * light + gleam))
}

pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn power_2(x: f32) -> f32 {
    x.max(0.0) * x
}

fn power_16(x: f32) -> f32 {
    let x2 = power_2(x);
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    x8 * x8
}

fn byte(x: f32) -> u8 {
    // `as` saturates, and turns NaN into 0
    (x + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamp_and_gleam_are_unit_vectors() {
        for v in [LAMP, GLEAM] {
            assert!((dot(v, v) - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn faces_towards_the_lamp_are_brighter() {
        let stone = |normal| stone(STONE, normal);
        assert!(stone(LAMP)[0] > stone([0.0, 0.0, 1.0])[0]);
        assert!(stone([0.0, 0.0, 1.0])[0] > stone([0.8, -0.6, 0.0])[0]);
        assert_eq!(ball([0.0; 3], [f32::NAN; 3]), [0; 3]);
    }
}
