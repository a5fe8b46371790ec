//! Transfer of each mechanism of a simulation into the block's parameters, or why it is refused; curves always are.

use model_core::left_out::wave::{Acts, ORDERS, Wave};
use model_core::params::Params;
use model_core::reference::zhou_2023::OIL;
use simulation::Simulation;
use simulation::curve::AddedCurve;
use simulation::file::PositionReference;
use simulation::guide::{GuideSet, Lubricant};
use simulation::mechanism::{Added, Form, Id};

use super::{Carried, Circumstances, NoImage, Refused, constant, most, table};

/// Share of the drag that a decaying effect may still have where the presliding guard ends.
const LEFT_BEHIND_GUARD: f64 = 1e-3;

/// Longest rest assumed for a breakaway force that grows without limit, s: a day.
const LONGEST_REST_S: f64 = 86_400.0;

/// Transfers all of them.
pub(super) fn all(
    simulation: &Simulation,
    set: &GuideSet,
    told: &Circumstances,
    params: &mut Params,
) -> Result<Vec<Carried>, NoImage> {
    let (mut carried, mut refused) = (Vec::new(), Vec::new());
    for (n, added) in simulation.mechanisms.iter().enumerate() {
        let Some(form) = added.form() else { continue };
        let twice = simulation.mechanisms[..n].iter().any(|before| before.id == added.id);
        let place = simulation.axis.position_reference;
        let outcome = if twice {
            Err("it stands in the simulation twice; leave one entry of it".to_owned())
        } else if form.phase_bound && place == PositionReference::Relative {
            Err("it is tied to a place of the rail, and [axis] position_reference = \"relative\" says that positions of \
                 two runs share no zero; reference the axis and diagnose it again"
                .to_owned())
        } else {
            one(simulation, set, told, params, &Numbers { added, form })
        };
        match outcome {
            Ok(how) => carried.push(Carried { id: added.id, form: form.name, how }),
            Err(why) => refused.push(Refused { id: added.id.name(), form: form.name, why }),
        }
    }
    refused.extend(simulation.curves.iter().map(nameless));
    // the mass that the law itself accelerates; the force sensor's gain acts on it as on the law
    let mass = simulation.axis.moved_mass_kg.unwrap_or(0.0) * (1.0 + f64::from(params.left_out.sensor.gain_error));
    params.left_out.pull.inertia_kg += mass as f32;
    if refused.is_empty() { Ok(carried) } else { Err(NoImage::Refused(refused)) }
}

/// Refuses a curve: the block has equations and no tables over axes, and an unnamed effect has no equation.
fn nameless(added: &AddedCurve) -> Refused {
    let axis = added.curve.axis.name();
    let why = format!(
        "it is a force along {axis} that nobody has a name for, and the block has no equation for it; find its cause, or leave \
         the entry out and live with its error"
    );
    Refused { id: "curve", form: axis, why }
}

/// The numbers of a mechanism by their names.
struct Numbers<'a> {
    added: &'a Added,
    form: &'a Form,
}

impl Numbers<'_> {
    /// A shape parameter or an amplitude; 0 for a name that the form lacks.
    fn of(&self, name: &str) -> f64 {
        let shape = self.form.shape.iter().map(|s| s.name).zip(&self.added.shape);
        let amplitudes = self.form.amplitudes.iter().map(|a| a.name).zip(&self.added.amplitudes);
        shape.chain(amplitudes).find(|(own, _)| *own == name).map_or(0.0, |(_, value)| *value)
    }

    fn f32(&self, name: &str) -> f32 {
        self.of(name) as f32
    }
}

type Outcome = Result<String, String>;

fn one(
    simulation: &Simulation,
    set: &GuideSet,
    told: &Circumstances,
    params: &mut Params,
    numbers: &Numbers<'_>,
) -> Outcome {
    let own = &mut params.left_out;
    let done = |what: &str| Ok(what.to_owned());
    let form = numbers.form.name;
    match (numbers.added.id, form) {
        (Id::SealDrag, "minimal" | "lip") => {
            own.seal.coulomb_n = own.seal.coulomb_n.map(|before| before + numbers.f32("drag_n"));
            own.seal.per_decade_n = numbers.f32("drag_per_decade_n");
            done("seal")
        }
        (Id::ViscousDrag, "minimal" | "churning") => {
            own.viscous.at_100_mm_s_n = [numbers.f32("drag_at_100_mm_s_n"); 2];
            own.viscous.at_100_cst_n = numbers.f32("drag_at_100_mm_s_and_100_cst_n");
            own.viscous.exponent = numbers.f32("exponent");
            done("viscous")
        }
        (Id::ViscosityTemperature, "minimal" | "rate") => oil(set, told, params, numbers),
        (Id::DirectionAsymmetry, "minimal" | "by-speed") => {
            own.asymmetry.part = numbers.f32("part");
            own.asymmetry.viscous_n_s_m = numbers.f32("viscous_n_s_m");
            done("asymmetry")
        }
        (Id::GravityTilt, "minimal") => {
            own.pull.force_n += numbers.f32("force_n");
            done("pull")
        }
        (Id::CableChain, "minimal") => {
            own.seal.coulomb_n = own.seal.coulomb_n.map(|before| before + numbers.f32("drag_n"));
            own.pull.force_n += numbers.f32("force_n");
            own.pull.per_m_n_m += numbers.f32("force_per_m_n_m");
            done("its drag with the seals, its weight as pull")
        }
        (Id::Inertia, "minimal") => {
            own.pull.inertia_kg += numbers.f32("mass_kg");
            done("pull")
        }
        (Id::ExternalLoad, "minimal" | "lopsided") => {
            let load = told.external_load_n.ok_or(
                "the block measures no load; say what it carries with --external-load-n, and --external-load-back-n where \
                 it differs on the way back",
            )?;
            own.load.load_n = load.map(|w| w as f32);
            own.load.part = numbers.f32("part");
            own.load.preload_per_load = numbers.f32("preload_per_load");
            Ok(format!("load, told {} N there and {} N back", load[0], load[1]))
        }
        (Id::BallPass, _) => {
            params.ball_pass_wavelength_m = numbers.f32("wavelength_m");
            wave(params, numbers, Acts::Preload, ["", "_1", "_2", "_3"])
        }
        (Id::RailStraightness, "minimal" | "bolts" | "three-orders") | (Id::Contamination, "particle") => {
            wave(params, numbers, Acts::Interference, ["", "_1", "_2", "_3"])
        }
        (Id::RailStraightness, "share-three-orders") => wave(params, numbers, Acts::Preload, ["", "_1", "_2", "_3"]),
        (Id::RailStraightness, "share-profile") => table::of(simulation, params, numbers.added, Acts::Preload),
        (Id::RailStraightness, "profile") => table::of(simulation, params, numbers.added, Acts::Interference),
        (Id::DriveRipple, "minimal") => wave(params, numbers, Acts::Force, ["_n", "", "", ""]),
        (Id::DriveRipple, "two-orders") => wave(params, numbers, Acts::Force, ["", "_1_n", "_2_n", ""]),
        (Id::DriveRipple, "coupling") => {
            wave(params, numbers, Acts::Force, ["_n", "", "", ""])?;
            let drag = Wave {
                acts: Acts::Drag,
                wavelength_m: numbers.f32("wavelength_m"),
                sine: [numbers.f32("drag_sine_n"), 0.0, 0.0],
                cosine: [numbers.f32("drag_cosine_n"), 0.0, 0.0],
            };
            place_wave(params, drag)?;
            done("two waves, one of force and one of friction")
        }
        (Id::RailJoint, _) => table::of(simulation, params, numbers.added, Acts::Interference),
        (Id::Contamination, "minimal") => table::of(simulation, params, numbers.added, Acts::Drag),
        (Id::Presliding, "minimal") => {
            // 2·part·exp(-s/length)
            guard(params, numbers.of("length_m") * (2.0 * numbers.of("part") / LEFT_BEHIND_GUARD).ln())
        }
        (Id::Presliding, "maxwell-slip") => guard(params, numbers.of("length_m")),
        (Id::BreakawayDwell, "minimal") => {
            let most = numbers.of("part_per_decade") * (1.0 + LONGEST_REST_S).log10();
            guard(params, numbers.of("length_m") * (most / LEFT_BEHIND_GUARD).ln())
        }
        (Id::BreakawayDwell, "saturating") => {
            guard(params, numbers.of("length_m") * (numbers.of("part") / LEFT_BEHIND_GUARD).ln())
        }
        (Id::CouplingBacklash, _) => guard(params, numbers.of("gap_m") + numbers.of("closing_m")),
        (Id::ForceOffset, "minimal") => {
            own.sensor.offset_n = numbers.f32("offset_n");
            done("sensor")
        }
        (Id::ForceGain, "minimal") => {
            own.sensor.gain_error = numbers.f32("gain_error");
            done("sensor")
        }
        (Id::ForceLowpass, "minimal" | "second-order") => {
            let filters = if form == "minimal" { 1.0 } else { 2.0 };
            own.sensor.lag_s += (filters * numbers.of("part") * numbers.of("time_s")) as f32;
            done("sensor, as a lag: exact where the force changes evenly over a third of a second")
        }
        (Id::TimeMisalignment, "minimal" | "shift") => {
            let part = if form == "minimal" { 1.0 } else { numbers.of("part") };
            own.sensor.lag_s += (part * numbers.of("delay_s")) as f32;
            done("sensor, as a lag: exact where the force changes evenly over a third of a second")
        }
        (id, _) => Err(reason(id)),
    }
}

/// Why the chip cannot run these mechanisms at all.
fn reason(id: Id) -> String {
    let why = match id {
        Id::SelfHeating => {
            "the block has no state for heat that its thermometer does not see; give it a thermometer at the \
                            contacts and diagnose viscosity-temperature"
        }
        Id::ThermalPreload => "the block has no thermometer in the rail",
        Id::MomentLoad => "it depends on forces that the block does not measure; take the moment off the carriage",
        Id::RunIn | Id::PreloadLoss => {
            "it is different on every metre run, and a block does not know how far it has run \
                                        before; run in first, then calibrate anew"
        }
        Id::Starvation => "the film's state is not known to a block; relubricate and diagnose again",
        Id::ForceDrift => "a zero that drifts cannot be foreseen; tare the sensor",
        Id::LoadCrosstalk => "the block measures no load",
        Id::HysteresisAndSlip | Id::HydrodynamicRolling | Id::TractionSaturation | Id::Stribeck => {
            "it changes how the drag depends on preload itself, which the block inverts in one fixed form; calibrate the \
             friction law anew with guideblock calibrate"
        }
        Id::FrictionalLag | Id::StructuralResonance => {
            "the block gives estimates in steady motion only, where it has died \
                                                        away; leave it out of the file"
        }
        Id::ForceQuantisation | Id::ForceSaturation => "what the converter lost cannot be restored; change its range",
        Id::SpeedNoise | Id::EncoderCyclicError => {
            "the block takes its speed over a third of a second, where it does not act; \
                                                    leave it out of the file"
        }
        _ => "the block has no equation for this form of it; diagnose with a simpler form",
    };
    why.to_owned()
}

/// Oil: the law has one viscosity; the block's oil follows the temperature.
fn oil(set: &GuideSet, told: &Circumstances, params: &mut Params, numbers: &Numbers<'_>) -> Outcome {
    let kept = params.viscosity.ln;
    let of_law = match set.lubricant() {
        // a law that is kept has its own viscosity
        _ if told.keep_law => (kept[1..] == [0.0; 3]).then(|| f64::from(kept[0]).exp()),
        Lubricant::Constant(nu) => Some(nu),
        Lubricant::Walther(_) => None,
    };
    let Some(nu) = of_law else {
        return Err("the law's oil follows temperature already, so this adds nothing; leave it out".to_owned());
    };
    let own = [params.viscosity.from_degc, params.viscosity.to_degc].map(f64::from);
    let [from, to] = told.temperature_degc.unwrap_or(own);
    let reference = numbers.of("reference_degc");
    params.viscosity = if numbers.form.name == "rate" {
        let rate = numbers.of("rate_per_k");
        let mut cubic = constant(nu, from, to);
        let centre = f64::from(cubic.centre_degc);
        cubic.ln[0] = (nu.ln() - rate * (centre - reference)) as f32;
        cubic.ln[1] = -rate as f32;
        cubic
    } else {
        let mut cubic = OIL.cubic(from, to).map_err(|why| why.to_string())?;
        cubic.ln[0] = (f64::from(cubic.ln[0]) + nu.ln() - OIL.viscosity_cst(reference).ln()) as f32;
        cubic
    };
    params.left_out.oil.part = numbers.f32("part");
    params.left_out.oil.law_cst = nu as f32;
    Ok(format!("oil, for {from} to {to} °C"))
}

/// The wave of a form whose amplitudes are called `sine` and `cosine` with one of these endings, order by order; the
/// first ending is that of a form of one order.
fn wave(params: &mut Params, numbers: &Numbers<'_>, acts: Acts, endings: [&str; ORDERS + 1]) -> Outcome {
    let [single, orders @ ..] = endings;
    let amplitude = |name: &str, order: usize| {
        let first = if order == 0 { numbers.of(&format!("{name}{single}")) } else { 0.0 };
        let of_order = orders.get(order).filter(|e| !e.is_empty()).map_or(0.0, |e| numbers.of(&format!("{name}{e}")));
        (first + of_order) as f32
    };
    let wave = Wave {
        acts,
        wavelength_m: numbers.f32("wavelength_m"),
        sine: std::array::from_fn(|order| amplitude("sine", order)),
        cosine: std::array::from_fn(|order| amplitude("cosine", order)),
    };
    place_wave(params, wave)?;
    Ok(format!("a wave of {:.4} m", wave.wavelength_m))
}

fn place_wave(params: &mut Params, wave: Wave) -> Result<(), String> {
    let waves = &mut params.left_out.waves;
    let most = waves.len();
    let free = waves.iter_mut().find(|w| !w.acts());
    *free.ok_or_else(|| {
        format!("the block runs {most} waves along the rail and this is one more; leave the smallest out")
    })? = wave;
    Ok(())
}

/// Lengthens the presliding guard over an effect that decays after a reversal.
fn guard(params: &mut Params, distance_m: f64) -> Outcome {
    let limit = most("presliding_guard_m");
    if distance_m > limit {
        return Err(format!(
            "it takes {:.0} mm of travel after a reversal to die away, and the block waits for {:.0} mm at most",
            1e3 * distance_m,
            1e3 * limit
        ));
    }
    params.presliding_guard_m = params.presliding_guard_m.max(distance_m as f32);
    Ok(format!("no estimates for {:.2} mm after a reversal", 1e3 * params.presliding_guard_m))
}
