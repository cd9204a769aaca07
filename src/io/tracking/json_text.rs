//! JSON with the line of each of its values, for messages.

use crate::io::number::shortened;

/// Most lists and objects inside each other.
const DEEPEST: usize = 100;

/// A value and the line where it begins.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub line: usize,
    pub value: Value,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Null,
    Bool,
    Number(f64),
    Text(String),
    List(Vec<Node>),
    /// In the order of the file.
    Object(Vec<(String, Node)>),
}

impl Node {
    /// Returns the value of the first of these keys that an object has.
    pub(super) fn get(&self, keys: &[&str]) -> Option<&Self> {
        let Value::Object(entries) = &self.value else { return None };
        keys.iter().find_map(|key| {
            entries.iter().find(|(own, _)| own.eq_ignore_ascii_case(key)).map(|(_, node)| node)
        })
    }

    /// Returns it as messages name it.
    pub(super) fn what(&self) -> String {
        match &self.value {
            Value::Null => "null".to_string(),
            Value::Bool => "true or false".to_string(),
            Value::Number(number) => number.to_string(),
            Value::Text(text) => format!("\"{}\"", shortened(text)),
            Value::List(list) => format!("an array of {}", list.len()),
            Value::Object(_) => "an object".to_string(),
        }
    }
}

/// A line, and what is wrong there.
type Wrong = (usize, String);

/// Reads the text of a file.
pub(super) fn parse(text: &str) -> Result<Node, Wrong> {
    let mut parser = Parser { rest: text, line: 1, depth: 0 };
    let node = parser.value()?;
    parser.skip_blanks();
    if parser.rest.is_empty() { Ok(node) } else { parser.wrong("trailing characters") }
}

/// The rest of a text, and its line.
struct Parser<'t> {
    rest: &'t str,
    line: usize,
    depth: usize,
}

impl Parser<'_> {
    fn wrong<T>(&self, message: impl Into<String>) -> Result<T, Wrong> {
        Err((self.line, message.into()))
    }

    fn skip(&mut self, bytes: usize) {
        self.line += self.rest[..bytes].matches('\n').count();
        self.rest = &self.rest[bytes..];
    }

    fn skip_blanks(&mut self) {
        self.skip(self.rest.len() - self.rest.trim_start_matches([' ', '\t', '\r', '\n']).len());
    }

    /// Skips a mark; returns whether it comes next.
    fn take(&mut self, mark: char) -> bool {
        self.skip_blanks();
        let is_next = self.rest.starts_with(mark);
        self.skip(usize::from(is_next));
        is_next
    }

    fn value(&mut self) -> Result<Node, Wrong> {
        self.skip_blanks();
        let line = self.line;
        let value = if self.take('[') {
            Value::List(self.items(']', Self::value)?)
        } else if self.take('{') {
            Value::Object(self.items('}', Self::entry)?)
        } else {
            self.scalar()?
        };
        Ok(Node { line, value })
    }

    fn entry(&mut self) -> Result<(String, Node), Wrong> {
        let Value::Text(key) = self.scalar()? else { return self.wrong("key must be a string") };
        if self.take(':') { Ok((key, self.value()?)) } else { self.wrong("expected `:`") }
    }

    /// Reads what is between commas until a list or an object ends.
    fn items<T>(&mut self, end: char, item: impl Fn(&mut Self) -> Result<T, Wrong>) -> Result<Vec<T>, Wrong> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return self.wrong("recursion limit exceeded");
        }
        let mut items = Vec::new();
        let mut is_end = self.take(end);
        while !is_end {
            items.push(item(self)?);
            is_end = self.take(end);
            if !is_end && !self.take(',') {
                return self.wrong(format!("expected `,` or `{end}`"));
            }
        }
        self.depth -= 1;
        Ok(items)
    }

    /// Reads a text, a number or a word.
    fn scalar(&mut self) -> Result<Value, Wrong> {
        self.skip_blanks();
        let mut stream = serde_json::Deserializer::from_str(self.rest).into_iter::<serde_json::Value>();
        let value = match stream.next() {
            Some(Ok(serde_json::Value::Null)) => Value::Null,
            Some(Ok(serde_json::Value::Bool(_))) => Value::Bool,
            Some(Ok(serde_json::Value::String(text))) => Value::Text(text),
            Some(Ok(number)) => Value::Number(number.as_f64().unwrap_or(f64::NAN)),
            Some(Err(error)) => {
                let message = error.to_string();
                return self
                    .wrong(message.rsplit_once(" at line ").map_or(message.as_str(), |(bare, _)| bare));
            }
            None => return self.wrong("EOF while parsing a value"),
        };
        self.skip(stream.byte_offset());
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_know_their_lines() {
        let node = parse("\n[{\"a\": [1,\n 2.5]},\n {\"B\": \"x\"}\n]\n").unwrap();
        let Value::List(list) = &node.value else { panic!("{node:?}") };
        assert_eq!((node.line, list[0].line, list[1].line), (2, 2, 4));
        assert_eq!(list[1].get(&["a", "b"]).unwrap().value, Value::Text("x".to_string()));
        assert_eq!(parse("[1,\n2,\n]").unwrap_err().0, 3);
        for wrong in ["[1] 2", "", "[1 2]", "{\"a\" 1}", "{1: 2}", "[nothing]"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
