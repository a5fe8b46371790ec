//! For tests of single steps of the search: the bench, the pool and the tolerances that the search has for a recording.

use simulation::Simulation;
use simulation::run::Run;

use crate::calibration::{Calibrated, calibrate};
use crate::fit::bench::Bench;
use crate::fit::member::Member;
use crate::fit::pool::{Pool, Tolerances};
use crate::fit::source::Source;
use crate::noise::rows::Rows;
use crate::nominal::Nominal;
use crate::recording::moving::Moving;
use crate::recording::side::Side;
use crate::report::DataQuality;
use crate::search::case::{Case, Given};

pub(crate) const GUIDE: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                                viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

/// Does something at the bench of these runs, around the law calibrated to them.
pub(crate) fn at_bench<T>(
    simulation: &Simulation,
    runs: &[Run],
    work: impl FnOnce(&mut Bench<'_>, &mut Pool, &Tolerances<'_>) -> T,
) -> T {
    let nominal = Nominal::new(simulation);
    let moving = Moving::as_recorded(runs);
    let mut quality = DataQuality::default();
    let side = Side::new(simulation, &nominal, &nominal.start(), &moving, false, &mut quality).expect("a side");
    let training = side.compared.clone();
    let mut rows = Rows::new(&moving.runs, &training, 1);
    let Calibrated { values, side, saturation, .. } =
        calibrate(simulation, &nominal, side, &mut rows, &training).expect("a law");
    let given = Given {
        simulation,
        nominal: &nominal,
        ringing: None,
        heard_n2: 0.0,
        discarded_n2: 0.0,
        edges: None,
        step_n: None,
    };
    let case = Case { given, side: &side, training: &training, saturation: &saturation, seen_from_m: 0.0 };
    let mut bench = case.around(&rows, &values).expect("a bench");
    let tolerances = Tolerances { nominal: &nominal, moved: &values };
    let mut pool = Pool::new(&bench, &tolerances, saturation.stories(), None);
    work(&mut bench, &mut pool, &tolerances)
}

/// These causes, taken as members.
pub(crate) fn taken(bench: &mut Bench<'_>, sources: impl IntoIterator<Item = Source>) -> Vec<Member> {
    let mut take = |source| {
        let candidate = bench.candidate(source).expect("it shows");
        bench.take(candidate)
    };
    sources.into_iter().map(&mut take).collect()
}
