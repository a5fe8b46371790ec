//! Instruction counts of chosen functions, by watches on their first instruction and their returns.

use std::collections::{BTreeMap, BTreeSet};

use rigless::emulator::Hit;

use crate::Error;
use crate::image::Symbols;
use crate::outcome::Cost;

/// The counters of one run.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    functions: Vec<Function>,
    /// First instructions of exception handlers: an arrival there disturbs every open call.
    handlers: BTreeSet<u64>,
}

#[derive(Debug)]
struct Function {
    name: String,
    entry: u64,
    returns: BTreeSet<u64>,
    open: Option<Call>,
    cost: Cost,
}

#[derive(Debug, Clone, Copy)]
struct Call {
    began: u64,
    interrupted: bool,
}

impl Counters {
    /// Counters for the functions `names`, with the handlers the vector table `vectors` points at.
    pub(crate) fn new(names: &[String], symbols: &Symbols, vectors: &[u32]) -> Result<Self, Error> {
        let functions = names
            .iter()
            .map(|name| {
                let entry = symbols.find(name)?.address;
                let returns: BTreeSet<u64> = symbols.returns_of(entry).into_iter().map(u64::from).collect();
                if returns.is_empty() {
                    return Err(Error::NeverCalled(name.clone()));
                }
                Ok(Function { name: name.clone(), entry: u64::from(entry), returns, open: None, cost: Cost::default() })
            })
            .collect::<Result<Vec<_>, Error>>()?;
        let handlers = if functions.is_empty() {
            BTreeSet::new()
        } else {
            vectors.iter().filter(|vector| *vector & 1 == 1).map(|vector| u64::from(vector & !1)).collect()
        };
        Ok(Self { functions, handlers })
    }

    /// Every instruction to watch.
    pub(crate) fn watched(&self) -> BTreeSet<u64> {
        let of_functions = self.functions.iter().flat_map(|f| f.returns.iter().copied().chain([f.entry]));
        of_functions.chain(self.handlers.iter().copied()).collect()
    }

    /// The core arrived at a watched instruction.
    pub(crate) fn hit(&mut self, hit: Hit) {
        let handler = self.handlers.contains(&hit.address);
        for function in &mut self.functions {
            if handler && let Some(call) = &mut function.open {
                call.interrupted = true;
            }
            if function.returns.contains(&hit.address)
                && let Some(call) = function.open.take()
            {
                function.cost.add(hit.instruction_count - call.began, call.interrupted);
            }
            if function.entry == hit.address && function.open.is_none() {
                function.open = Some(Call { began: hit.instruction_count, interrupted: false });
            }
        }
    }

    /// The chip restarted: calls under way never return.
    pub(crate) fn restart(&mut self) {
        for function in &mut self.functions {
            function.open = None;
        }
    }

    /// The figures, by name.
    pub(crate) fn into_costs(self) -> BTreeMap<String, Cost> {
        self.functions.into_iter().map(|function| (function.name, function.cost)).collect()
    }
}

impl Cost {
    fn add(&mut self, instructions: u64, interrupted: bool) {
        if interrupted {
            self.interrupted += 1;
            return;
        }
        self.min = if self.calls == 0 { instructions } else { self.min.min(instructions) };
        self.max = self.max.max(instructions);
        self.last = instructions;
        self.calls += 1;
    }
}
