// The syntax of .rfm files for tree-sitter. The definition is ../rfm.pest; tests/it/editors.rs compares their words.

const ITEMS = ["import", "param", "let", "fn", "solid", "scene"];
const FOLDS = ["any", "all", "sum", "product", "min", "max", "list"];
const UNITS = [
  "kPa", "MPa", "mPa", "Pa", "deg", "rad", "rpm", "min", "mm", "cm", "km", "um", "µm", "μm", "kg", "kJ", "kN", "mN",
  "ms", "us", "Hz", "N", "J", "m", "g", "s", "h", "°",
];

// weakest first
// the fold and the choice take everything to their right
const BINDS = { fold: 0, or: 1, and: 2, not: 3, compare: 4, sum: 5, product: 6, sign: 7, power: 8, postfix: 9 };

const separated = (rule) => optional(seq(rule, repeat(seq(",", rule)), optional(",")));

const unitPower = `(${[...UNITS].sort((a, b) => b.length - a.length).join("|")})(\\^-?[0-9]|²|³)?`;
// a point needs a digit behind it: `0..6` is a range, and there is no looking ahead here
const numeral = "([0-9]+(\\.[0-9]+)?|\\.[0-9]+)([eE][-+−]?[0-9]+)?";

module.exports = grammar({
  name: "rfm",
  extras: ($) => [/[\s\u00A0\uFEFF]/, $.comment],
  word: ($) => $.name,
  conflicts: ($) => [[$.argument, $._expression], [$._name, $.fold], [$._name, $.call]],
  rules: {
    file: ($) => seq(optional($.version), repeat($._item)),
    comment: () => token(choice(/#[^\n]*/, /\/\/[^\n]*/)),
    version: () => token(seq("rfm", /[ \t]+/, /[0-9]+/)),

    _item: ($) => choice($.import, $.param, $.let, $.function, $.solid, $.scene),
    import: ($) => seq("import", field("path", $.text), "as", field("name", $.name)),
    param: ($) =>
      seq("param", field("name", $.name), "=", field("value", $._expression), optional($.range), optional($.text)),
    range: ($) => seq("in", $._expression, "..", $._expression),
    let: ($) => seq("let", field("name", $.name), "=", field("value", $._expression)),
    function: ($) =>
      seq("fn", field("name", $.name), "(", separated($.parameter), ")", "=", field("body", $._expression)),
    parameter: ($) => seq(field("name", $._name), optional(seq("=", $._expression))),
    solid: ($) => seq(repeat($.attribute), "solid", field("name", $.name), "=", field("value", $._expression)),
    attribute: ($) => seq("@", $.name, "(", separated($.argument), ")"),

    scene: ($) => seq("scene", field("name", $.name), $._entries),
    _entries: ($) => seq("{", repeat(seq(choice($.block, $.setting), optional(","))), "}"),
    block: ($) => seq(field("key", $._key), optional(field("label", $.name)), $._entries),
    setting: ($) => seq(field("key", $._key), ":", field("value", $._expression)),
    // words that begin a fold or a call are names elsewhere
    _name: ($) => choice($.name, ...["sum", "product", "min", "max", "list"].map((word) => alias(word, $.name))),
    // a key may be spelled like a keyword
    _key: ($) => choice($.name, ...[...ITEMS, ...FOLDS].map((word) => alias(word, $.name))),

    _expression: ($) =>
      choice(
        $.logic, $.negation, $.comparison, $.sum, $.product, $.sign, $.power, $.postfix, $.fold, $.choice,
        $.quantity, $.number, $.text, $.vector, $.call, $._name, $.group,
      ),
    logic: ($) =>
      choice(
        prec.left(BINDS.or, seq($._expression, choice("or", "∨", "|", "||"), $._expression)),
        prec.left(BINDS.and, seq($._expression, choice("and", "∧", "&", "&&", "\\", "∖"), $._expression)),
      ),
    negation: ($) => prec(BINDS.not, seq(choice("not", "¬", "!"), $._expression)),
    comparison: ($) =>
      prec.left(
        BINDS.compare,
        seq($._expression, choice("<=", ">=", "==", "=<", "=>", "!=", "<", ">", "≤", "≥"), $._expression),
      ),
    sum: ($) => prec.left(BINDS.sum, seq($._expression, choice("+", "-", "−"), $._expression)),
    product: ($) => prec.left(BINDS.product, seq($._expression, choice("*", "/", "·", "×", "÷"), $._expression)),
    sign: ($) => prec(BINDS.sign, seq(choice("-", "−", "+"), $._expression)),
    power: ($) => prec.right(BINDS.power, seq($._expression, "^", $._expression)),
    postfix: ($) =>
      prec.left(
        BINDS.postfix,
        seq(
          $._expression,
          choice(
            choice("²", "³"),
            seq(token.immediate("["), $._expression, "]"),
            seq(".", field("method", $.name), "(", separated($.argument), ")"),
            // a component, or a name of an imported file
            seq(".", field("member", $.name)),
          ),
        ),
      ),
    fold: ($) =>
      prec(
        BINDS.fold,
        seq(choice(...FOLDS), field("variable", $.name), "in", $._expression, optional(seq("..", $._expression)), ":",
          $._expression),
      ),
    choice: ($) =>
      prec(
        BINDS.fold,
        seq("if", field("condition", $._expression), "then", $._expression, "else", $._expression),
      ),
    group: ($) => seq("(", $._expression, ")"),
    vector: ($) => seq("[", separated($._expression), "]"),
    call: ($) =>
      prec(
        BINDS.postfix,
        seq(field("function", $._name), "(", separated($.argument), ")"),
      ),
    argument: ($) => choice(seq(field("name", $._name), "=", $._expression), $._expression),

    quantity: () => token(prec(1, new RegExp(`${numeral}[ \\t]*${unitPower}([/·]${unitPower})*`))),
    number: () => token(new RegExp(numeral)),
    text: () => token(/"[^"\n]*"/),
    name: () => /[\p{L}_][\p{L}0-9_]*/,
  },
});
