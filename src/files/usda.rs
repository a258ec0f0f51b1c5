//! Reader for the parts of USD's text format (usda) that animation needs: prims, their attributes
//! with numbers and words, and the layer's metadata.
//!
//! Other values, relationships, variants and arrays of points are skipped. Layers that a file
//! names are not read.

use std::collections::{BTreeMap, BTreeSet};

/// Largest depth of nested prims.
const MOST_DEPTH: usize = 256;

/// A prim with its content.
#[derive(Clone, Debug, Default)]
pub(super) struct Prim {
    /// Type such as `Camera`; empty for an `over`, and for a `class`, which is never drawn.
    pub(super) kind: String,
    pub(super) name: String,
    /// Keys of its metadata, and `variantSets` if it has one.
    pub(super) metadata: BTreeSet<String>,
    /// Attributes by name, without types.
    pub(super) attributes: BTreeMap<String, Value>,
    pub(super) children: Vec<Prim>,
}

/// Value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Numbers, tuples flattened; empty without numbers.
    Numbers(Vec<f64>),
    /// One or more words.
    Words(Vec<String>),
    /// Numbers at time codes, in ascending order.
    Samples(Vec<(f64, Vec<f64>)>),
}

/// A layer: its metadata and its root prims.
#[derive(Clone, Debug, Default)]
pub(super) struct Layer {
    pub(super) metadata: BTreeMap<String, Value>,
    pub(super) prims: Vec<Prim>,
}

impl Layer {
    /// Reads the text of a layer.
    ///
    /// # Errors
    /// A description with the line.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        if !text.starts_with("#usda") {
            return Err("it does not begin with #usda".to_owned());
        }
        let mut reader = Reader {
            tokens: Tokens::new(text),
            depth: 0,
        };
        let mut layer = Self::default();
        while let Some(token) = reader.tokens.next()? {
            match token {
                Token::Sign('(') => reader.metadata(&mut layer.metadata)?,
                Token::Word(word) if is_specifier(&word) => {
                    layer.prims.push(reader.prim(&word)?);
                }
                Token::Word(word) if word == "reorder" => reader.pass_statement()?,
                other => {
                    return Err(reader
                        .tokens
                        .fault(&format!("{other:?} does not begin a prim")));
                }
            }
        }
        Ok(layer)
    }
}

fn is_specifier(word: &str) -> bool {
    matches!(word, "def" | "over" | "class")
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    /// Names and keywords, including colons and dots within them.
    Word(String),
    /// Quoted text, or the name of an asset or path.
    Text(String),
    Number(f64),
    /// One of `( ) [ ] { } = , ; :`.
    Sign(char),
}

struct Tokens<'a> {
    text: &'a str,
    at: usize,
    line: usize,
    /// The next token, if it was peeked at.
    held: Option<Token>,
}

impl<'a> Tokens<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            text,
            at: 0,
            line: 1,
            held: None,
        }
    }

    fn fault(&self, what: &str) -> String {
        format!("line {}: {what}", self.line)
    }

    fn peek(&mut self) -> Result<Option<&Token>, String> {
        if self.held.is_none() {
            self.held = self.read()?;
        }
        Ok(self.held.as_ref())
    }

    fn next(&mut self) -> Result<Option<Token>, String> {
        match self.held.take() {
            Some(token) => Ok(Some(token)),
            None => self.read(),
        }
    }

    /// Returns the next token, or an error at the end of the file.
    fn need(&mut self) -> Result<Token, String> {
        let found = self.next()?;
        found.ok_or_else(|| self.fault("the file ends too early"))
    }

    fn is_next(&mut self, sign: char) -> Result<bool, String> {
        Ok(self.peek()? == Some(&Token::Sign(sign)))
    }

    /// Consumes the sign if it is next.
    fn take(&mut self, sign: char) -> Result<bool, String> {
        let is = self.is_next(sign)?;
        if is {
            self.held = None;
        }
        Ok(is)
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn step(&mut self, bytes: usize) -> &'a str {
        let part = &self.text[self.at..self.at + bytes];
        self.line += part.matches('\n').count();
        self.at += bytes;
        part
    }

    fn read(&mut self) -> Result<Option<Token>, String> {
        loop {
            let rest = self.rest();
            let blank = rest.len() - rest.trim_start().len();
            self.step(blank);
            if !self.rest().starts_with('#') {
                break;
            }
            let end = self.rest().find('\n').unwrap_or(self.rest().len());
            self.step(end);
        }
        let Some(first) = self.rest().chars().next() else {
            return Ok(None);
        };
        match first {
            '"' | '\'' => self.quoted(first).map(Some),
            '@' if self.rest().starts_with("@@@") => self.long_asset().map(Some),
            '@' => self.until("@", "@").map(Some),
            '<' => self.until("<", ">").map(Some),
            '(' | ')' | '[' | ']' | '{' | '}' | '=' | ',' | ';' | ':' => {
                self.step(1);
                Ok(Some(Token::Sign(first)))
            }
            _ => self.word(first).map(Some),
        }
    }

    fn quoted(&mut self, quote: char) -> Result<Token, String> {
        let one = quote.to_string();
        let three = one.repeat(3);
        let mark = if self.rest().starts_with(&three) {
            three
        } else {
            one
        };
        self.step(mark.len());
        let mut text = String::new();
        loop {
            let rest = self.rest();
            if rest.starts_with(&mark) {
                self.step(mark.len());
                return Ok(Token::Text(text));
            }
            let mut chars = rest.chars();
            let Some(next) = chars.next() else {
                return Err(self.fault("a string has no end"));
            };
            let escaped = (next == '\\').then(|| chars.next()).flatten();
            self.step(next.len_utf8() + escaped.map_or(0, char::len_utf8));
            text.push(escaped.unwrap_or(next));
        }
    }

    fn until(&mut self, begin: &str, end: &str) -> Result<Token, String> {
        self.step(begin.len());
        let Some(length) = self.rest().find(end) else {
            return Err(self.fault(&format!("{begin} has no {end}")));
        };
        let text = self.step(length).to_owned();
        self.step(end.len());
        Ok(Token::Text(text))
    }

    /// Reads an asset's name between `@@@`. It may contain `@`; `\@@@` stands for `@@@`; of a
    /// longer run of `@`, the last three end the name.
    fn long_asset(&mut self) -> Result<Token, String> {
        const MARK: &str = "@@@";
        self.step(MARK.len());
        let mut name = String::new();
        loop {
            let Some(length) = self.rest().find(MARK) else {
                return Err(self.fault(&format!("{MARK} has no {MARK}")));
            };
            name.push_str(self.step(length));
            self.step(MARK.len());
            if name.ends_with('\\') {
                name.pop();
                name.push_str(MARK);
                continue;
            }
            let more = self.rest().chars().take_while(|&c| c == '@').count().min(2);
            name.push_str(self.step(more));
            return Ok(Token::Text(name));
        }
    }

    fn word(&mut self, first: char) -> Result<Token, String> {
        let is_of_number = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '+' | '-');
        if first.is_ascii_digit() || matches!(first, '-' | '+' | '.') {
            let rest = self.rest();
            let length = rest.find(|c| !is_of_number(c)).unwrap_or(rest.len());
            let text = self.step(length);
            return match text.parse() {
                Ok(number) => Ok(Token::Number(number)),
                Err(_) => Err(self.fault(&format!("{text:?} is not a number"))),
            };
        }
        let is_of_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | ':' | '.' | '!');
        let rest = self.rest();
        let length = rest.find(|c| !is_of_word(c)).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.fault(&format!("{first:?} belongs to nothing")));
        }
        // A trailing colon belongs to what follows.
        let word = self.rest()[..length].trim_end_matches(':');
        let length = word.len().max(1);
        Ok(Token::Word(self.step(length).to_owned()))
    }
}

struct Reader<'a> {
    tokens: Tokens<'a>,
    depth: usize,
}

impl Reader<'_> {
    /// Reads a prim after its specifier.
    fn prim(&mut self, specifier: &str) -> Result<Prim, String> {
        self.depth += 1;
        if self.depth > MOST_DEPTH {
            return Err(self.tokens.fault("more prims within prims than a file has"));
        }
        let mut prim = Prim::default();
        loop {
            match self.tokens.need()? {
                Token::Word(word) => prim.kind = word,
                Token::Text(name) => {
                    prim.name = name;
                    break;
                }
                other => {
                    let what = format!("{other:?} behind {specifier}, and no name");
                    return Err(self.tokens.fault(&what));
                }
            }
        }
        if specifier == "class" {
            prim.kind.clear();
        }
        if self.tokens.take('(')? {
            let mut metadata = BTreeMap::new();
            self.metadata(&mut metadata)?;
            prim.metadata = metadata.into_keys().collect();
        }
        if !self.tokens.take('{')? {
            return Err(self
                .tokens
                .fault(&format!("prim {:?} has no body", prim.name)));
        }
        loop {
            match self.tokens.need()? {
                Token::Sign('}') => break,
                Token::Sign(';') => {}
                Token::Word(word) if is_specifier(&word) => prim.children.push(self.prim(&word)?),
                Token::Word(word) if word == "variantSet" || word == "reorder" => {
                    if word == "variantSet" {
                        prim.metadata.insert("variantSets".to_owned());
                    }
                    self.pass_statement()?;
                }
                Token::Word(word) => self.property(&word, &mut prim.attributes)?,
                other => {
                    return Err(self
                        .tokens
                        .fault(&format!("{other:?} does not begin a property")));
                }
            }
        }
        self.depth -= 1;
        Ok(prim)
    }

    /// Reads `type name = value (metadata)` after its first word.
    fn property(&mut self, first: &str, into: &mut BTreeMap<String, Value>) -> Result<(), String> {
        let mut name = first.to_owned();
        loop {
            match self.tokens.peek()? {
                Some(Token::Word(_)) => {
                    let Token::Word(word) = self.tokens.need()? else {
                        continue;
                    };
                    if is_specifier(&word) {
                        // A declaration without a value precedes a prim.
                        self.tokens.held = Some(Token::Word(word));
                        return Ok(());
                    }
                    name = word;
                }
                Some(Token::Sign('[')) => {
                    // Brackets of an array type.
                    self.tokens.need()?;
                    if !self.tokens.take(']')? {
                        return Err(self.tokens.fault("a [ behind a type without ]"));
                    }
                }
                _ => break,
            }
            if self.begins_line_of_its_own() {
                break;
            }
        }
        if self.tokens.take('=')? {
            let value = self.value()?;
            let name = name.strip_suffix(".timeSamples").unwrap_or(&name);
            // Time samples take precedence over a default value.
            let is_told = matches!(into.get(name), Some(Value::Samples(_)));
            if let Some(value) = value
                && (!is_told || matches!(value, Value::Samples(_)))
            {
                into.insert(name.to_owned(), value);
            }
        }
        if self.tokens.take('(')? {
            self.metadata(&mut BTreeMap::new())?;
        }
        Ok(())
    }

    /// Whether another statement follows: a declaration may have no value.
    fn begins_line_of_its_own(&self) -> bool {
        if self.tokens.held.is_some() {
            return false;
        }
        let rest = self.tokens.rest();
        let blank = &rest[..rest.len() - rest.trim_start().len()];
        blank.contains('\n')
    }

    /// Reads `name = value` up to the closing parenthesis.
    fn metadata(&mut self, into: &mut BTreeMap<String, Value>) -> Result<(), String> {
        loop {
            match self.tokens.need()? {
                Token::Sign(')') => return Ok(()),
                Token::Sign(';' | ',') | Token::Text(_) => {}
                // Layer offset of a reference.
                Token::Sign(open @ ('(' | '[' | '{')) => {
                    self.list(open)?;
                }
                Token::Word(first) => {
                    let mut name = first;
                    while let Some(Token::Word(_)) = self.tokens.peek()? {
                        if let Token::Word(word) = self.tokens.need()? {
                            name = word;
                        }
                    }
                    if self.tokens.take('=')?
                        && let Some(value) = self.value()?
                    {
                        into.insert(name, value);
                    }
                }
                other => return Err(self.tokens.fault(&format!("{other:?} in metadata"))),
            }
        }
    }

    /// Skips to the end of a statement: a value or a body.
    fn pass_statement(&mut self) -> Result<(), String> {
        loop {
            match self.tokens.need()? {
                Token::Sign('=') => {
                    self.value()?;
                    return Ok(());
                }
                Token::Word(_) | Token::Text(_) => {}
                other => return Err(self.tokens.fault(&format!("{other:?} in a statement"))),
            }
        }
    }

    /// Reads a value; `None` if it has neither numbers nor words.
    fn value(&mut self) -> Result<Option<Value>, String> {
        match self.tokens.need()? {
            Token::Number(number) => Ok(Some(Value::Numbers(vec![number]))),
            Token::Text(text) => Ok(Some(Value::Words(vec![text]))),
            Token::Word(word) => {
                // Words such as `None`, `true` or `inf`.
                let number = word.parse::<f64>().ok();
                Ok(number.map(|number| Value::Numbers(vec![number])))
            }
            Token::Sign(open @ ('(' | '[')) => self.list(open).map(Some),
            Token::Sign('{') => self.braces(),
            other => Err(self.tokens.fault(&format!("{other:?} is not a value"))),
        }
    }

    /// Reads all numbers or words up to the sign that closes `open`.
    fn list(&mut self, open: char) -> Result<Value, String> {
        let (mut numbers, mut words) = (Vec::new(), Vec::new());
        let mut opened = vec![open];
        while let Some(&last) = opened.last() {
            match self.tokens.need()? {
                Token::Number(number) => numbers.push(number),
                Token::Text(text) | Token::Word(text) => words.push(text),
                Token::Sign(sign @ ('(' | '[' | '{')) if opened.len() < MOST_DEPTH => {
                    opened.push(sign);
                }
                Token::Sign(sign @ (')' | ']' | '}')) => {
                    let wanted = match last {
                        '(' => ')',
                        '[' => ']',
                        _ => '}',
                    };
                    if sign != wanted {
                        return Err(self.tokens.fault(&format!("{sign:?} closes {last:?}")));
                    }
                    opened.pop();
                }
                Token::Sign(_) => {}
            }
        }
        Ok(match words.is_empty() {
            true => Value::Numbers(numbers),
            false => Value::Words(words),
        })
    }

    /// Reads time samples; skips a dictionary or body.
    fn braces(&mut self) -> Result<Option<Value>, String> {
        if !matches!(self.tokens.peek()?, Some(Token::Number(_))) {
            self.list('{')?;
            return Ok(None);
        }
        let mut samples = Vec::new();
        loop {
            match self.tokens.need()? {
                Token::Sign('}') => break,
                Token::Sign(',') => {}
                Token::Number(time) if self.tokens.take(':')? => {
                    // Blocked samples and non-numbers are dropped.
                    if let Some(Value::Numbers(numbers)) = self.value()? {
                        samples.push((time, numbers));
                    }
                }
                other => return Err(self.tokens.fault(&format!("{other:?} among time samples"))),
            }
        }
        samples.sort_by(|a: &(f64, Vec<f64>), b| a.0.total_cmp(&b.0));
        Ok(Some(Value::Samples(samples)))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]
mod tests {
    use super::*;

    /// Asset names as read by OpenUSD 26.11.
    #[test]
    fn assets_are_named_between_one_mark_or_three() {
        for (text, name) in [
            ("@./a.usda@", "./a.usda"),
            ("@@@./a@b.usda@@@", "./a@b.usda"),
            ("@@@./a\\@@@b.usda@@@", "./a@@@b.usda"),
            ("@@@./a@@@@@", "./a@@"),
            ("@@@@a@@@", "@a"),
        ] {
            let layer = Layer::read(&format!("#usda 1.0\n(\n    subLayers = [{text}]\n)\n"));
            let found = layer.unwrap().metadata.remove("subLayers");
            assert_eq!(found, Some(Value::Words(vec![name.to_owned()])), "{text}");
        }
        // Control: nothing ends the name.
        for text in ["@./a", "@@@./a@@", "@@@./a\\@@@"] {
            let read = Layer::read(&format!("#usda 1.0\n(\n    subLayers = [{text}]\n)\n"));
            assert!(read.is_err(), "{text}");
        }
    }
}
