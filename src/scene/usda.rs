//! USD's text (usda), as far as what moves needs it: prims, their attributes of numbers and words, the layer's own metadata.
//!
//! Values of other kinds, relationships, variants and arrays of points are passed over. Layers that a file names are not read.

use std::collections::{BTreeMap, BTreeSet};

/// Prims within prims, at most.
const MOST_DEPTH: usize = 256;

/// A prim with what is written in it.
#[derive(Clone, Debug, Default)]
pub(super) struct Prim {
    /// Such as `Camera`; empty of an `over`, and of a `class`, which is drawn nowhere.
    pub(super) kind: String,
    pub(super) name: String,
    /// Keys of its metadata, and `variantSets` where it has one.
    pub(super) metadata: BTreeSet<String>,
    /// By their names, without types.
    pub(super) attributes: BTreeMap<String, Value>,
    pub(super) children: Vec<Prim>,
}

/// What an attribute has.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Numbers, tuples one after the other; nothing where there is no number.
    Numbers(Vec<f64>),
    /// One word, or several.
    Words(Vec<String>),
    /// Numbers at time codes, in ascending order.
    Samples(Vec<(f64, Vec<f64>)>),
}

/// A layer: its metadata, and the prims at its root.
#[derive(Clone, Debug, Default)]
pub(super) struct Layer {
    pub(super) metadata: BTreeMap<String, Value>,
    pub(super) prims: Vec<Prim>,
}

impl Layer {
    /// Reads a layer's text.
    ///
    /// # Errors
    /// What is wrong, with its line.
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
                other => return Err(reader.tokens.fault(&format!("{other:?} begins no prim"))),
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
    /// Names, keywords, with the colons and dots within them.
    Word(String),
    /// In quotes, an asset's or a path's name.
    Text(String),
    Number(f64),
    /// One of ( ) [ ] { } = , ; :
    Sign(char),
}

struct Tokens<'a> {
    text: &'a str,
    at: usize,
    line: usize,
    /// The next one, where it was looked at.
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

    /// The next token, which has to be there.
    fn need(&mut self) -> Result<Token, String> {
        let found = self.next()?;
        found.ok_or_else(|| self.fault("the file ends too early"))
    }

    fn is_next(&mut self, sign: char) -> Result<bool, String> {
        Ok(self.peek()? == Some(&Token::Sign(sign)))
    }

    /// Takes the sign if it is next.
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
                return Err(self.fault("a text has no end"));
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

    /// An asset's name between `@@@`: it may hold `@`, `\@@@` stands for `@@@`, and of more than three at its end the last three end it.
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
                Err(_) => Err(self.fault(&format!("{text:?} is no number"))),
            };
        }
        let is_of_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | ':' | '.' | '!');
        let rest = self.rest();
        let length = rest.find(|c| !is_of_word(c)).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.fault(&format!("{first:?} belongs to nothing")));
        }
        // A colon behind a word belongs to what follows.
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
    /// A prim from behind its specifier on.
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
                other => return Err(self.tokens.fault(&format!("{other:?} begins no property"))),
            }
        }
        self.depth -= 1;
        Ok(prim)
    }

    /// `type name = value (metadata)`, from behind its first word on.
    fn property(&mut self, first: &str, into: &mut BTreeMap<String, Value>) -> Result<(), String> {
        let mut name = first.to_owned();
        loop {
            match self.tokens.peek()? {
                Some(Token::Word(_)) => {
                    let Token::Word(word) = self.tokens.need()? else {
                        continue;
                    };
                    if is_specifier(&word) {
                        // A declaration without a value stood before a prim.
                        self.tokens.held = Some(Token::Word(word));
                        return Ok(());
                    }
                    name = word;
                }
                Some(Token::Sign('[')) => {
                    // Of an array's type.
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
            // A value that is told at times goes before one that is not.
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

    /// Whether what follows begins another statement: a declaration may stand without a value.
    fn begins_line_of_its_own(&self) -> bool {
        if self.tokens.held.is_some() {
            return false;
        }
        let rest = self.tokens.rest();
        let blank = &rest[..rest.len() - rest.trim_start().len()];
        blank.contains('\n')
    }

    /// `name = value` up to the closing parenthesis.
    fn metadata(&mut self, into: &mut BTreeMap<String, Value>) -> Result<(), String> {
        loop {
            match self.tokens.need()? {
                Token::Sign(')') => return Ok(()),
                Token::Sign(';' | ',') | Token::Text(_) => {}
                // Of a reference: how its times are shifted.
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

    /// Up to the end of what a word begins: a value, or a body.
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

    /// A value; `None` of what is neither numbers nor words.
    fn value(&mut self) -> Result<Option<Value>, String> {
        match self.tokens.need()? {
            Token::Number(number) => Ok(Some(Value::Numbers(vec![number]))),
            Token::Text(text) => Ok(Some(Value::Words(vec![text]))),
            Token::Word(word) => {
                // `None`, `true`, `inf`.
                let number = word.parse::<f64>().ok();
                Ok(number.map(|number| Value::Numbers(vec![number])))
            }
            Token::Sign(open @ ('(' | '[')) => self.list(open).map(Some),
            Token::Sign('{') => self.braces(),
            other => Err(self.tokens.fault(&format!("{other:?} is no value"))),
        }
    }

    /// All numbers or words up to the sign that closes `open`.
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

    /// Time samples, or a dictionary or body, which is passed over.
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
                    // What is blocked, or no number, has none.
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

    /// Names of assets as OpenUSD 26.11 reads them.
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
        // The control: nothing ends it.
        for text in ["@./a", "@@@./a@@", "@@@./a\\@@@"] {
            let read = Layer::read(&format!("#usda 1.0\n(\n    subLayers = [{text}]\n)\n"));
            assert!(read.is_err(), "{text}");
        }
    }
}
