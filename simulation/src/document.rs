//! TOML text as sections of keys with their positions, so that a mistake can be pointed at.

use std::ops::Range as Span;

use model_core::quantity::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Why a file is refused, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {what}")]
pub struct BadFile {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong, and what would be right.
    pub what: String,
}

impl BadFile {
    /// A mistake at a place of the text that was read.
    pub(crate) fn at(text: &str, mistake: Mistake) -> Self {
        let before = text.get(..mistake.offset).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        BadFile { line, column, what: mistake.what }
    }
}

/// A mistake and its byte offset in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mistake {
    offset: usize,
    what: String,
}

impl Mistake {
    pub(crate) fn new(span: &Span<usize>, what: impl Into<String>) -> Self {
        Mistake { offset: span.start, what: what.into() }
    }

    /// A mistake of the file as a whole.
    pub(crate) fn at_start(what: impl Into<String>) -> Self {
        Mistake { offset: 0, what: what.into() }
    }
}

/// Reads TOML.
pub(crate) fn parse(text: &str) -> Result<Spanned<DeTable<'_>>, Mistake> {
    DeTable::parse(text)
        .map_err(|error| Mistake::new(&error.span().unwrap_or_default(), error.message().trim_end().to_owned()))
}

/// One key with its value.
#[derive(Clone, Debug)]
pub(crate) struct Item<'a> {
    /// Section that contains it; empty at the top of the file.
    pub(crate) section: &'a str,
    pub(crate) key: &'a str,
    pub(crate) key_span: Span<usize>,
    pub(crate) value: &'a Spanned<DeValue<'a>>,
}

/// The items of a table, in the order of the file's keys.
pub(crate) fn items<'a>(section: &'a str, table: &'a DeTable<'a>) -> impl Iterator<Item = Item<'a>> {
    table.iter().map(move |(key, value)| Item { section, key: key.get_ref(), key_span: key.span(), value })
}

impl<'a> Item<'a> {
    /// Full name of the key in messages.
    pub(crate) fn name(&self) -> String {
        if self.section.is_empty() { self.key.to_owned() } else { format!("{}.{}", self.section, self.key) }
    }

    /// A mistake in the value.
    pub(crate) fn wrong(&self, what: impl Into<String>) -> Mistake {
        Mistake::new(&self.value.span(), what)
    }

    /// The mistake of an unknown key.
    pub(crate) fn unknown(&self, known: &[&str]) -> Mistake {
        Mistake::new(&self.key_span, format!("there is no key {}; there are: {}", self.name(), known.join(", ")))
    }

    /// What the value is, for messages about another kind.
    fn found(&self) -> String {
        match self.value.get_ref() {
            DeValue::String(text) => format!("the text {text:?}"),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.to_string(),
            DeValue::Boolean(value) => value.to_string(),
            DeValue::Datetime(time) => format!("the time {time}"),
            DeValue::Array(_) => "a list".to_owned(),
            DeValue::Table(_) => "a table".to_owned(),
        }
    }

    /// The value as a section of its own.
    pub(crate) fn table(&self) -> Result<&'a DeTable<'a>, Mistake> {
        self.value.get_ref().as_table().ok_or_else(|| self.wrong(format!("{} must be a table", self.name())))
    }

    /// The value as text.
    pub(crate) fn text(&self) -> Result<&'a str, Mistake> {
        self.value
            .get_ref()
            .as_str()
            .ok_or_else(|| self.wrong(format!("{} must be a text in quotes, not {}", self.name(), self.found())))
    }

    /// The value as one of a few names.
    pub(crate) fn one_of(&self, names: &[&'static str]) -> Result<&'static str, Mistake> {
        let got = self.value.get_ref().as_str();
        names
            .iter()
            .find(|name| Some(**name) == got)
            .copied()
            .ok_or_else(|| self.wrong(format!("{} must be one of: \"{}\"", self.name(), names.join("\", \""))))
    }

    /// The value as a number, integer or not.
    pub(crate) fn any_number(&self) -> Result<f64, Mistake> {
        let number = match self.value.get_ref() {
            // beyond 2^53 nothing is in range anyway
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
            DeValue::Float(x) => x.as_str().parse().ok(),
            _ => None,
        };
        number.ok_or_else(|| self.wrong(format!("{} must be a number, not {}", self.name(), self.found())))
    }

    /// The value as a number within a range; the message states the range.
    pub(crate) fn number(&self, range: &Range) -> Result<f64, Mistake> {
        let x = self.any_number()?;
        within(range, x).map_err(|what| self.wrong(format!("{} {what}", self.name())))?;
        Ok(x)
    }
}

/// Checks a number against a range; the text returned continues the number's name.
pub(crate) fn within(range: &Range, x: f64) -> Result<(), String> {
    if x >= range.min && x <= range.max {
        return Ok(());
    }
    Err(format!("must lie between {} and {} {}, not {x}", range.min, range.max, range.unit).replace(" ,", ","))
}
