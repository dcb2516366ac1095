(comment) @comment
(version) @keyword.directive
(text) @string
(number) @number
(quantity) @number

["import" "as" "param" "let" "fn" "solid" "scene"] @keyword
["and" "or" "not" "in" "if" "then" "else" "any" "all" "sum" "product" "min" "max" "list"] @keyword.operator
["∧" "∨" "¬" "∖" "\\" "&" "&&" "|" "||" "!" "<=" ">=" "≤" "≥" "<" ">" "+" "-" "−" "*" "/" "·" "×" "÷" "^" "²" "³" "=" ".."] @operator
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["," ":" "."] @punctuation.delimiter

(param name: (name) @constant)
(import name: (name) @module)
(let name: (name) @variable)
(function name: (name) @function)
(parameter name: (name) @variable.parameter)
(solid name: (name) @type)
(scene name: (name) @module)
(attribute (name) @attribute)
(setting key: (name) @property)
(block key: (name) @property)
(call function: (name) @function.call)
(postfix method: (name) @function.method.call)
(argument name: (name) @variable.parameter)
((name) @constant.builtin (#any-of? @constant.builtin "x" "y" "z" "t" "pi"))
