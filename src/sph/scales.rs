//! The numbers of a fluid from which a method derives its limits, its walls and its pressures.

/// How a wall acts on a fluid that moves along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Slip {
    /// The fluid slips along the wall without friction.
    #[default]
    Free,
    /// The fluid at the wall has the wall's velocity: viscosity acts between the two.
    No,
}

/// What a method needs to know about the fluid to derive numbers of its own, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Rest density ρ₀, kg/m³.
    pub rest_density: f64,
    /// Mass with which one particle counts in sums over neighbours, kg.
    pub particle_mass: f64,
    /// Support radius h, m.
    pub support_radius: f64,
    /// Dynamic viscosity, Pa·s.
    pub viscosity: f64,
    /// Surface tension, N/m.
    pub surface_tension: f64,
    /// The greatest speed that is expected, m/s.
    pub expected_speed: f64,
    /// Whether the fluid sticks to any wall.
    pub sticks: bool,
}

impl Scales {
    /// Distance between particles at rest, (m/ρ₀)^⅓, m.
    pub fn spacing(&self) -> f64 {
        (self.particle_mass / self.rest_density).cbrt()
    }
}
