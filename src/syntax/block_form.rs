//! How a block of a scene is written, for those who wrote its key with a value.

/// The block `key`, where `value`, a text of the user's, stands for what was most likely meant; an example of the block if it
/// can be nothing. `None` if the key opens no block of a scene. `is_name_of_shape` says whether a value that is a name is that
/// of a shape.
pub fn block_form(key: &str, value: &str, is_name_of_shape: bool) -> Option<String> {
    let is_name = value.chars().all(|c| c.is_alphanumeric() || c == '_');
    let begins_with = |first: fn(&char) -> bool| value.chars().next().as_ref().is_some_and(first);
    let is_number = begins_with(char::is_ascii_digit);
    let is_shape = is_name_of_shape || !is_name && begins_with(|c| c.is_alphabetic());
    Some(match key {
        "obstacle" | "container" => format!("{key} {{ solid: {value} }}"),
        "fluid" if is_shape => format!("fluid water {{ shape: {value} }}"),
        "fluid" => "fluid water { shape: ball([0.5, 0.5, 0.5], 0.2), particles: 10000 }".into(),
        "box" if value.starts_with('[') => format!("box {{ max: {value} }}"),
        "box" => "box { min: [0, 0, 0], max: [1, 1, 1] }".into(),
        "flux" if value.starts_with('[') => format!("flux {{ point: {value}, normal: [1, 0, 0] }}"),
        "flux" => "flux { point: [0.5, 0.5, 0.5], normal: [1, 0, 0] }".into(),
        "run" if is_number => format!("run {{ until: {value} }}"),
        "run" => "run { until: 2 s }".into(),
        "picture" => "picture { camera: [0, -1, 0.3], cut: y <= 0 }".into(),
        _ => return None,
    })
}
