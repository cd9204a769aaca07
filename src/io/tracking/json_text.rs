//! JSON with the line of each of its values, for messages.

use std::cell::Cell;
use std::fmt;
use std::io::Read;

use serde::Deserializer;
use serde::de::{DeserializeSeed, MapAccess, SeqAccess, Visitor};

/// A value and the line where it begins (of a number or a word, where it ends).
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
    /// The first of these keys that an object has.
    pub(super) fn get(&self, keys: &[&str]) -> Option<&Self> {
        let Value::Object(entries) = &self.value else { return None };
        keys.iter().find_map(|key| {
            entries.iter().find(|(own, _)| own.eq_ignore_ascii_case(key)).map(|(_, node)| node)
        })
    }

    /// As messages name it.
    pub(super) fn what(&self) -> String {
        match &self.value {
            Value::Null => "null".to_string(),
            Value::Bool => "true or false".to_string(),
            Value::Number(number) => number.to_string(),
            Value::Text(text) => format!("\"{}\"", crate::io::number::shortened(text)),
            Value::List(list) => format!("an array of {}", list.len()),
            Value::Object(_) => "an object".to_string(),
        }
    }
}

/// Reads the text of a file; `Err` with the line and what is wrong with it.
pub(super) fn parse(text: &str) -> Result<Node, (usize, String)> {
    let line = Cell::new(1);
    let mut deserializer =
        serde_json::Deserializer::from_reader(Counted { rest: text.as_bytes(), line: &line });
    let read = Seed(&line).deserialize(&mut deserializer);
    read.and_then(|node| deserializer.end().map(|()| node)).map_err(|error| {
        let message = error.to_string();
        let bare = message.rsplit_once(" at line ").map_or(message.as_str(), |(bare, _)| bare).to_string();
        (error.line().max(1), bare)
    })
}

/// Counts the lines that were read; `serde_json` asks for one byte after the other.
struct Counted<'a> {
    rest: &'a [u8],
    line: &'a Cell<usize>,
}

impl Read for Counted<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let n = self.rest.read(into)?;
        let ends = into[..n].iter().filter(|byte| **byte == b'\n').count();
        self.line.set(self.line.get() + ends);
        Ok(n)
    }
}

/// Makes a node of the value that comes next.
#[derive(Clone, Copy)]
struct Seed<'a>(&'a Cell<usize>);

impl Seed<'_> {
    fn node<E>(self, value: Value) -> Result<Node, E> {
        Ok(Node { line: self.0.get(), value })
    }
}

impl<'de> DeserializeSeed<'de> for Seed<'_> {
    type Value = Node;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Node, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Seed<'_> {
    type Value = Node;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Node, E> {
        self.node(Value::Null)
    }

    fn visit_bool<E>(self, _: bool) -> Result<Node, E> {
        self.node(Value::Bool)
    }

    fn visit_f64<E>(self, number: f64) -> Result<Node, E> {
        self.node(Value::Number(number))
    }

    fn visit_i64<E>(self, number: i64) -> Result<Node, E> {
        self.node(Value::Number(number as f64))
    }

    fn visit_u64<E>(self, number: u64) -> Result<Node, E> {
        self.node(Value::Number(number as f64))
    }

    fn visit_str<E>(self, text: &str) -> Result<Node, E> {
        self.node(Value::Text(text.to_string()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Node, A::Error> {
        let line = self.0.get();
        let nodes = std::iter::from_fn(|| list.next_element_seed(self).transpose());
        Ok(Node { line, value: Value::List(nodes.collect::<Result<_, _>>()?) })
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Node, A::Error> {
        let line = self.0.get();
        let mut entries = Vec::new();
        while let Some(key) = map.next_key::<String>()? {
            entries.push((key, map.next_value_seed(self)?));
        }
        Ok(Node { line, value: Value::Object(entries) })
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
        let (line, message) = parse("[1,\n2,\n]").unwrap_err();
        assert!(line == 3 && message.contains("trailing comma"), "{line}: {message}");
        assert!(parse("[1] 2").is_err() && parse("").is_err());
    }
}
