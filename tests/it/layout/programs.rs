//! Random programs: files that the grammar accepts and that mean something, written by someone who does not
//! care for layout.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// A program with the number `seed`, as tokens that random blanks, line ends and comments hold apart.
pub fn program(seed: u64) -> String {
    let mut writer = Writer { chance: Pcg64::seed_from_u64(seed), tokens: Vec::new(), values: Vec::new() };
    for _ in 0..1 + writer.below(6) {
        writer.item();
    }
    if writer.below(3) == 0 {
        writer.scene();
    }
    writer.text()
}

struct Writer {
    chance: Pcg64,
    tokens: Vec<String>,
    /// Names of numbers and fields that are defined.
    values: Vec<String>,
}

impl Writer {
    fn below(&mut self, n: u32) -> u32 {
        self.chance.next_u32() % n
    }

    fn one(&mut self, words: &[&str]) -> String {
        words[self.below(words.len() as u32) as usize].to_string()
    }

    fn put(&mut self, words: &str) {
        self.tokens.extend(words.split(' ').map(String::from));
    }

    fn put_one(&mut self, words: &[&str]) {
        let word = self.one(words);
        self.tokens.push(word);
    }

    fn item(&mut self) {
        let name = format!("n{}", self.values.len());
        match self.below(4) {
            0 => {
                self.put(&format!("param {name} ="));
                let value = self.one(&["1", "1.5", ".75", "1.", "1e0"]);
                self.put(&value);
                if self.below(2) == 0 {
                    self.put("in 0.5 .. 2.");
                }
                if self.below(2) == 0 {
                    self.tokens.push("\"a size # no comment\"".into());
                }
            }
            1 => {
                self.put(&format!("let {name} ="));
                self.field(2);
            }
            2 => {
                self.put(&format!("fn f{name} ( a , b = 2 ) = a + b *"));
                self.factor(2);
                let (first, second) = (self.one(&["x", "1", "y"]), self.one(&["", ", 3", ", b = z"]));
                self.put(
                    &format!("let {name} = f{name} ( {first} {second} )")
                        .replace("  ", " ")
                        .replace(", ", " , "),
                );
            }
            _ => {
                if self.below(4) == 0 {
                    self.put("@tolerance ( 1e6 )");
                }
                self.put(&format!("solid {name} ="));
                self.field(3);
            }
        }
        self.tokens.retain(|token| !token.is_empty());
        self.values.push(name);
    }

    /// Operands joined by logic.
    fn field(&mut self, depth: u32) {
        self.comparison(depth);
        while self.below(6) == 0 {
            self.put_one(&["and", "or", "\\", "&", "|", "&&", "||", "∧", "∨", "∖"]);
            if self.below(4) == 0 {
                self.put_one(&["not", "!", "¬"]);
            }
            self.comparison(depth);
        }
    }

    fn comparison(&mut self, depth: u32) {
        self.sum(depth);
        if self.below(3) == 0 {
            self.put_one(&["<=", ">=", "≤", "≥"]);
            self.sum(depth);
        }
    }

    fn sum(&mut self, depth: u32) {
        self.product(depth);
        while self.below(6) == 0 {
            self.put_one(&["+", "-", "−"]);
            self.product(depth);
        }
    }

    fn product(&mut self, depth: u32) {
        self.factor(depth);
        while self.below(6) == 0 {
            self.put_one(&["*", "/", "·", "×", "÷"]);
            self.factor(depth);
        }
    }

    fn factor(&mut self, depth: u32) {
        while self.below(4) == 0 {
            self.put_one(&["-", "−", "+"]);
        }
        self.primary(depth);
        while self.below(7) == 0 {
            self.put_one(&["²", "³"]);
        }
        while self.below(7) == 0 {
            self.put("^");
            if self.below(3) == 0 {
                self.put("-");
            }
            self.put_one(&["2", "3", "x²", "2 ²", "2²³", "(z + 1)", "3."]);
        }
    }

    fn primary(&mut self, depth: u32) {
        if depth == 0 {
            let defined = self.below(8) as usize;
            match self.values.get(defined) {
                Some(name) => self.tokens.push(name.clone()),
                None => self.put_one(&[
                    "x", "y", "z", "2", ".5", "3.", "1e−1", "90°", "2 m", "0.3 mm", "pi", "(3 m) ",
                ]),
            }
            return;
        }
        let depth = depth - 1;
        match self.below(10) {
            0 => {
                self.put("(");
                self.field(depth);
                self.put(")");
            }
            1 => {
                self.put_one(&["sqrt", "abs", "sin", "cos"]);
                self.put("(");
                self.field(depth);
                self.put(")");
            }
            2 => {
                self.put("( sphere ( 1 ) ) . move ( [");
                self.sum(0);
                self.put(", 0 , 1");
                self.put_one(&[",", "", ""]);
                self.put("] )");
            }
            3 => {
                self.put("( ");
                self.put_one(&["any", "all", "sum", "min", "max", "product", "list"]);
                self.put_one(&[
                    "i in 0 .. 2 :",
                    "i in 0..2:",
                    "i in 0. .. .2e1 :",
                    "i in [ 1 , 2 ] :",
                    "i in [ .5 ] :",
                ]);
                self.put("i *");
                self.field(depth.min(1));
                self.put(")");
            }
            4 => {
                self.put("[ x , y ,");
                self.field(depth.min(2));
                self.put("]");
                self.put_one(&[".x", ".y", "[0]", "[ 1 ]"]);
            }
            5 => self.put("box ( min = [ -1 , 0 , 0 ] )"),
            7 => {
                self.put_one(&["( if x >= 0 then", "( if 2 == 1 then", "( if not y <= 1 and z <= 2 then"]);
                self.field(depth.min(1));
                self.put("else");
                self.field(depth.min(1));
                self.put(")");
            }
            6 => self.put("min ( x , max ( y , z ) )"),
            _ => self.primary(0),
        }
        self.tokens.retain(|token| !token.is_empty());
    }

    fn scene(&mut self) {
        self.put("scene s { box { max : [ 1 , 1 , 1 ] , restitution : 0.5 }");
        self.put_one(&["", ","]);
        self.put("fluid water { shape : ball ( [ 0.5 , 0.5 , 0.5 ] , 0.3 ) , particles : 30 ,");
        self.tokens.push("density: 998.29 kg/m^3".into());
        self.put_one(&["", ","]);
        self.tokens.push("viscosity: 3.5 Pa·s".into());
        self.put("} gravity : [ 0 , 0 , -1 ] method : wcsph run { until : 0.1 }");
        self.put_one(&["", ","]);
        self.put("}");
        self.tokens.retain(|token| !token.is_empty());
    }

    /// The tokens with random blanks between them. Nothing stands between an index and its list, or a number
    /// and its unit.
    fn text(mut self) -> String {
        let mut text = String::from("rfm 1\n");
        let tokens = std::mem::take(&mut self.tokens);
        for (i, token) in tokens.iter().enumerate() {
            let before = tokens.get(i.wrapping_sub(1)).map_or("", String::as_str);
            let is_index = token.starts_with('[') && token.ends_with(']') && token.len() > 2;
            if i > 0 && !is_index {
                let marks = |word: &str| word.chars().all(|c| "()[]{},:=+".contains(c));
                let tight = marks(before) || marks(token);
                let gap = self.gap(tight && !(before == "=" && token.starts_with('=')));
                text.push_str(&gap);
            }
            text.push_str(token);
        }
        text.push_str(&self.gap(true));
        text
    }

    fn gap(&mut self, tight: bool) -> String {
        match self.below(24) {
            0 => "\n".into(),
            1 => format!("\n{}", " ".repeat(self.below(14) as usize)),
            2 => format!("  # comment {}\n", self.below(100)),
            3 => format!(" // {}\n\n\n   # more  \n{}", self.below(9), " ".repeat(self.below(9) as usize)),
            4 => " ".repeat(1 + self.below(7) as usize),
            5 => "\n\n".into(),
            6 => "\t".into(),
            n if n < 16 && tight => String::new(),
            _ => " ".into(),
        }
    }
}
