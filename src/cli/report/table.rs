//! A table of a report, as lines of text and in a page.

/// A column: its name, its width in characters, and whether its cells stand at its left.
pub(super) struct Column {
    pub name: &'static str,
    width: usize,
    pub is_left: bool,
}

impl Column {
    /// A column of words.
    pub const fn words(name: &'static str, width: usize) -> Self {
        Self { name, width, is_left: true }
    }

    /// A column of numbers.
    pub const fn numbers(name: &'static str, width: usize) -> Self {
        Self { name, width, is_left: false }
    }

    fn cell(&self, text: &str) -> String {
        let Self { width, is_left, .. } = *self;
        if is_left { format!("{text:<width$}") } else { format!("{text:>width$}") }
    }
}

/// The line with the names of columns.
pub(super) fn head(columns: &[Column]) -> String {
    columns.iter().map(|column| column.cell(column.name)).collect::<Vec<_>>().join(" ")
}

/// A line of cells.
pub(super) fn line(columns: &[Column], cells: &[String]) -> String {
    columns.iter().zip(cells).map(|(column, cell)| column.cell(cell)).collect::<Vec<_>>().join(" ")
}

/// A number with an exponent; a dash where there is none.
pub(super) fn scientific(x: Option<f64>) -> String {
    x.map_or("–".to_string(), |x| format!("{x:.1e}"))
}

/// An order of convergence; a dash where there is none.
pub(super) fn order(order: Option<f64>) -> String {
    order.map_or("–".to_string(), |order| format!("{order:.2}"))
}
