//! The obstacles' formula for the graphics processor, with the params of the file as uniforms.

use serde::Serialize;

use super::messages::refused;
use super::model::Checked;
use rfm::source::{self, Param};
use rfm::{Engine, Program, Solid};

/// The most operations of formulas that pages march rays through: drivers take seconds for longer ones.
const MOST_OPERATIONS: usize = 600;

/// What is sent to a page about the obstacles' formula.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub(super) struct Field {
    /// The text of [`source::marched`]; `None` if only meshes can be shown.
    source: Option<String>,
    /// Why there is none; empty if there are no obstacles.
    reason: String,
    /// The uniforms for params, each with the name of its param.
    uniforms: Vec<(String, String)>,
    /// The params with other values than these the formula is not good for.
    fixed: Vec<String>,
    moves: bool,
}

impl Field {
    /// The formula of what stands in a scene, or of a solid. `standing` are these solids with their params as
    /// constants.
    pub fn of(checked: &Checked, standing: &[Solid]) -> Self {
        let found = if standing.is_empty() { Ok(Self::default()) } else { Self::open(checked, standing) };
        found.unwrap_or_else(|reason| Self { reason, ..Self::default() })
    }

    fn open(checked: &Checked, standing: &[Solid]) -> Result<Self, String> {
        if checked.scene.as_ref().is_some_and(|scene| scene.container.is_some()) {
            return Err("the fluid is in a container, whose walls go beyond the box".into());
        }
        let size: usize = standing.iter().map(operations).sum();
        let too_large = |size| {
            Err(format!("its formula has {size} operations, and {MOST_OPERATIONS} is the most for this"))
        };
        if size > MOST_OPERATIONS {
            return too_large(size);
        }
        let (opened, fixed) =
            checked.program.with_open_params_of(standing.iter().map(Solid::name)).map_err(refused)?;
        let solids = opened_solids(&opened, standing)?;
        let params = opened.module().params.iter();
        let params = params.map(|p| Param { name: p.name.clone(), value: p.value, doc: None });
        let params: Vec<Param> = params.collect();
        let made = source::marched(&solids, &params).map_err(|error| error.to_string())?;
        if made.operations > MOST_OPERATIONS {
            return too_large(made.operations);
        }
        let (uniforms, moves) = (made.uniforms, made.moves);
        Ok(Self { source: Some(made.text), reason: String::new(), uniforms, fixed, moves })
    }
}

/// How many operations decide the sign of a solid.
fn operations(solid: &Solid) -> usize {
    let (graph, root) = solid.formula();
    graph.reachable(&[root]).into_iter().filter(|&used| used).count()
}

/// The solids that stand in the scene, with params as arguments.
fn opened_solids(opened: &Program, standing: &[Solid]) -> Result<Vec<Solid>, String> {
    let is_known = |name: &str| opened.module().solids.iter().any(|solid| solid.name == name);
    let open = |solid: &Solid| match solid.name() {
        name if is_known(name) => opened.solid_with(name, Engine::Interpreter).map_err(refused),
        name => Err(format!("`{name}` is no solid of the file itself")),
    };
    standing.iter().map(open).collect()
}
