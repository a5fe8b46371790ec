use super::*;
use crate::replay::UNPROGRAMMED;
use model_core::left_out::Passage;
use simulation::motion::Motion;
use simulation::run::{Break, Part, Run};

const HEAD: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n\
                    contact_angle_mode = \"fixed\"\n[lubricant]\nviscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

fn simulation(mechanisms: &str) -> Simulation {
    Simulation::from_toml(&format!("{HEAD}{mechanisms}")).unwrap_or_else(|why| panic!("{why}\n{mechanisms}"))
}

const TOLD: Circumstances = Circumstances {
    external_load_n: Some([400.0, 400.0]),
    start_m: 0.0,
    temperature_degc: Some([15.0, 45.0]),
    keep_law: false,
};

/// Mechanisms that the block runs, each with numbers that make a few per cent of the drag.
const CARRIED: [(&str, &str); 18] = [
    ("seal", "id = \"seal-drag\"\ndrag_n = 4.0"),
    ("seal", "id = \"seal-drag\"\nform = \"lip\"\ndrag_n = 3.0\ndrag_per_decade_n = 0.4"),
    ("viscous", "id = \"viscous-drag\"\nexponent = 0.7\ndrag_at_100_mm_s_n = 2.0"),
    ("oil", "id = \"viscosity-temperature\"\nform = \"rate\"\nreference_degc = 30.0\nrate_per_k = 0.04\npart = 0.93"),
    ("asymmetry", "id = \"direction-asymmetry\"\npart = 0.04"),
    ("asymmetry", "id = \"direction-asymmetry\"\nform = \"by-speed\"\npart = -0.03\nviscous_n_s_m = 6.0"),
    ("load", "id = \"external-load\"\npart = 1.0"),
    ("load", "id = \"external-load\"\nform = \"lopsided\"\npart = 0.9\npreload_per_load = 0.06"),
    ("pull", "id = \"gravity-tilt\"\nforce_n = 0.8"),
    ("pull", "id = \"inertia\"\nmass_kg = 12.0"),
    ("sensor", "id = \"force-offset\"\noffset_n = -0.6"),
    ("sensor", "id = \"force-gain\"\ngain_error = 0.02"),
    ("waves", "id = \"ball-pass\"\nwavelength_m = 0.0143\nsine = 0.02\ncosine = 0.015"),
    (
        "waves",
        "id = \"ball-pass\"\nform = \"two-orders\"\nwavelength_m = 0.0143\nsine_1 = 0.02\ncosine_1 = 0.01\nsine_2 = 0.005\ncosine_2 = -0.004",
    ),
    (
        "waves",
        "id = \"rail-straightness\"\nform = \"three-orders\"\nwavelength_m = 0.6\nsine_1 = 0.05\ncosine_1 = 0.02\n\
         sine_2 = -0.02\ncosine_2 = 0.01\nsine_3 = 0.01\ncosine_3 = 0.005",
    ),
    ("waves", "id = \"drive-ripple\"\nwavelength_m = 0.01\nsine_n = 0.5\ncosine_n = 0.3"),
    (
        "waves",
        "id = \"drive-ripple\"\nform = \"coupling\"\nwavelength_m = 0.01\nsine_n = 0.5\ncosine_n = 0.3\n\
         drag_sine_n = 0.2\ndrag_cosine_n = 0.1",
    ),
    ("seal", "id = \"cable-chain\"\ndrag_n = 1.0\nforce_per_m_n_m = 2.0\nforce_n = 0.5"),
];

fn entry(text: &str) -> String {
    format!("[[mechanism]]\n{text}\n")
}

/// Steady passages at many working points, one row each.
fn run() -> Run {
    let mut run = Run::default();
    let (mut preload, mut degc, mut load) = (Vec::new(), Vec::new(), Vec::new());
    let (mut x, mut v, mut a) = (Vec::new(), Vec::new(), Vec::new());
    for (n, p) in [700.0, 1500.0, 3000.0, 7000.0].into_iter().enumerate() {
        for (k, speed) in [0.002, -0.005, 0.02, -0.05, 0.09].into_iter().enumerate() {
            let row = 5 * n + k;
            run.time_s.push(row as f64);
            run.drag_force_n.push(1.0);
            // places that f32 holds exactly, or a wave's phase would be lost on the way
            x.push((1.0 + row as f64 * 53.0) / 1024.0);
            v.push(f64::from(speed as f32));
            a.push(0.01 * (row as f64 - 9.0) / 16.0);
            preload.push(p);
            degc.push(20.0 + row as f64);
            load.push(400.0);
        }
    }
    let rows = x.len();
    run.position_m = Some(x);
    run.velocity_m_s = Some(v);
    run.acceleration_m_s2 = Some(a);
    run.preload_n = Some(preload);
    run.temperature_block_degc = Some(degc);
    run.external_load_n = Some(load);
    run.parts = vec![Part { rows: 0..rows, segment: None, starts: Break::Start }];
    run
}

/// Largest relative error of the block's preload on the desk's forces.
fn worst(simulation: &Simulation, told: &Circumstances) -> f64 {
    let params = build(simulation, &UNPROGRAMMED, told).unwrap_or_else(|why| panic!("{why}")).record.params;
    let run = run();
    let motion = Motion::of(&run);
    let force = simulation.force(&run, &motion).expect("everything is there");
    let column = |c: &Option<Vec<f64>>, n: usize| c.as_ref().expect("given")[n];
    let mut worst = 0.0f64;
    for (n, force) in force.iter().enumerate() {
        let v = column(&run.velocity_m_s, n) as f32;
        let passage = Passage {
            speed_m_s: v,
            acceleration_m_s2: motion.acceleration_m_s2[n] as f32,
            force_rate_n_s: 0.0,
            viscosity_cst: params.viscosity.at(column(&run.temperature_block_degc, n) as f32).expect("inside").cst,
            place_m: column(&run.position_m, n) as f32,
            travel_m: 1e-7,
        };
        let drag = (force * f64::from(v.signum())) as f32;
        let law = params.law;
        let got = params
            .left_out
            .preload(&law, params.viscosity_number_per_cst, drag, &passage, |f, b| law.invert(f, b))
            .unwrap_or_else(|why| panic!("row {n}: {why:?}"));
        worst = worst.max((f64::from(got.preload_n) / column(&run.preload_n, n) - 1.0).abs());
    }
    worst
}

/// The f64 reference is the desk's own simulation of the augmented file, with the exact contact model.
#[test]
fn the_block_inverts_the_desk_s_augmented_model() {
    for (acts, text) in CARRIED {
        let simulation = simulation(&entry(text));
        let image = build(&simulation, &UNPROGRAMMED, &TOLD).unwrap_or_else(|why| panic!("{text}: {why}"));
        assert!(image.record.params.left_out.acting().names().any(|name| name == acts), "{text}");
        let worst = worst(&simulation, &TOLD);
        assert!(worst < 1e-5, "{text}: {worst:.1e}");
    }
    // all that fit beside each other: the richer form of each, three waves
    let all: String = [1, 2, 3, 5, 7, 8, 9, 10, 11, 13, 14, 15].into_iter().map(|n| entry(CARRIED[n].1)).collect();
    let worst = worst(&simulation(&all), &TOLD);
    println!("all mechanisms at once: preload of the block against the desk's, worst {worst:.1e}");
    assert!(worst < 1e-5, "{worst:.1e}");
}

#[test]
fn the_oil_of_a_data_sheet_is_followed_as_well_as_its_cubic() {
    let text = entry("id = \"viscosity-temperature\"\nreference_degc = 30.0\npart = 1.0");
    let told = |temperature_degc| Circumstances { temperature_degc, ..TOLD };
    for (range, limit) in [([19.0, 40.0], 2e-4), ([5.0, 65.0], 5e-3)] {
        let worst = worst(&simulation(&text), &told(Some(range)));
        println!("oil by its grade over {range:?} degC: worst error of the preload {worst:.1e}");
        assert!(worst < limit, "{range:?}: {worst:.1e}");
    }
}

#[test]
fn a_calibrated_block_keeps_its_law_and_takes_the_mechanisms() {
    let mut base = UNPROGRAMMED;
    base.params.law.mu_coulomb *= 1.1;
    let text = format!("[columns]\npreload_n = \"preload_n:1.0944\"\n{}", entry(CARRIED[0].1));
    let simulation = simulation(&text);
    let told = Circumstances { keep_law: true, ..TOLD };
    let kept = build(&simulation, &base, &told).expect("legal");
    let mut expected = base.params;
    expected.left_out.seal.coulomb_n = [4.0; 2];
    assert_eq!((kept.record.params, kept.notes.len()), (expected, 0));
    // otherwise a person is told what the scale of preload has become
    let taken = build(&simulation, &base, &TOLD).expect("legal");
    assert_ne!(taken.record.params.law, base.params.law);
    assert!(taken.notes.len() == 1 && taken.notes[0].contains("1.0944"), "{:?}", taken.notes);
    // oil that the simulation found against a constant one: the record's own constant is the law's
    let oil =
        entry("id = \"viscosity-temperature\"\nform = \"rate\"\nreference_degc = 30.0\nrate_per_k = 0.04\npart = 1.0");
    let oil = Simulation::from_toml(&format!("{HEAD}{oil}")).expect("legal");
    assert!(build(&oil, &base, &told).expect_err("its oil follows temperature").to_string().contains("already"));
    base.params.viscosity = constant(80.0, 5.0, 65.0);
    let params = build(&oil, &base, &told).expect("legal").record.params;
    assert!((params.left_out.oil.law_cst / 80.0 - 1.0).abs() < 1e-6);
    assert!((params.viscosity.at(30.0).expect("inside").cst / 80.0 - 1.0).abs() < 1e-5);
}

#[test]
fn places_become_a_table() {
    for text in [
        "id = \"rail-joint\"\nplace_m = 0.5\npreload = 0.1",
        "id = \"rail-joint\"\nform = \"step\"\nplace_m = 0.5\npreload = 0.1\npreload_beyond = -0.06",
        "id = \"contamination\"\nplace_m = 0.5\ndrag_n = 3.0",
    ] {
        let simulation = simulation(&entry(text));
        let image = build(&simulation, &UNPROGRAMMED, &TOLD).unwrap_or_else(|why| panic!("{text}: {why}"));
        assert!(image.record.params.left_out.acting().names().eq(["rail"]), "{text}");
        // the lines of the table, a tenth of a percent of the largest value at most
        let worst = worst(&simulation, &TOLD);
        println!("{text}: {worst:.1e}; {}", image.carried[0].how);
        assert!(worst < 1e-4, "{text}: {worst:.1e}");
    }
    // a table on the desk: its entries are the knots
    let entries: String = (0..48).map(|n| format!("at_{n:02} = {:.4}\n", 0.05 * (0.4 * f64::from(n)).sin())).collect();
    let simulation = simulation(&entry(&format!(
        "id = \"rail-straightness\"\nform = \"profile\"\nfrom_m = 0.0\nto_m = 1.0\n{entries}"
    )));
    let image = build(&simulation, &UNPROGRAMMED, &TOLD).unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(image.record.params.left_out.rail.knots, 48);
    let worst = worst(&simulation, &TOLD);
    println!("a profile of the rail: {worst:.1e}");
    assert!(worst < 1e-5, "{worst:.1e}");
}

#[test]
fn what_dies_away_behind_a_reversal_is_waited_for() {
    let guard = |text: &str| {
        let image = build(&simulation(&entry(text)), &UNPROGRAMMED, &TOLD).unwrap_or_else(|why| panic!("{why}"));
        image.record.params.presliding_guard_m
    };
    // 2·0.9·exp(-s/l) = 1e-3
    let expected = 3e-4 * (2.0 * 0.9 / 1e-3f64).ln();
    assert!((f64::from(guard("id = \"presliding\"\nlength_m = 3e-4\npart = 0.9")) / expected - 1.0).abs() < 1e-6);
    // shorter than the block's own guard: that stays
    assert_eq!(guard("id = \"presliding\"\nlength_m = 1e-5\npart = 0.9"), UNPROGRAMMED.params.presliding_guard_m);
    let text = entry("id = \"coupling-backlash\"\ngap_m = 0.09\npart = 1.0\nform = \"closing\"\nclosing_m = 0.02");
    let NoImage::Refused(refused) = build(&simulation(&text), &UNPROGRAMMED, &TOLD).expect_err("too long") else {
        panic!("another reason")
    };
    assert!(refused[0].why.contains("110 mm"), "{refused:?}");
}

#[test]
fn what_the_chip_cannot_run_is_refused_by_name_all_at_once() {
    let text = [
        "id = \"seal-drag\"\ndrag_n = 4.0",
        "id = \"self-heating\"\ntime_s = 600.0\nlog_viscosity_per_w = -0.03",
        "id = \"thermal-preload\"\npreload_per_k = -0.02",
        "id = \"external-load\"\npart = 1.0",
    ]
    .map(entry)
    .concat();
    let why = build(&simulation(&text), &UNPROGRAMMED, &Circumstances::default()).expect_err("refused");
    let NoImage::Refused(refused) = &why else { panic!("{why}") };
    assert_eq!(refused.iter().map(|r| r.id).collect::<Vec<_>>(), ["self-heating", "thermal-preload", "external-load"]);
    let message = why.to_string();
    for word in ["self-heating (form minimal) cannot run on the block", "--external-load-n"] {
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn a_force_without_a_name_is_refused_with_its_axis() {
    let curve = "\n[[curve]]\naxis = \"velocity\"\ncarrier = \"odd\"\nat = [0.01, 0.1]\nheight = [0.0, 0.7]\n";
    let seal = entry("id = \"seal-drag\"\ndrag_n = 4.0");
    for keep_law in [false, true] {
        let told = Circumstances { keep_law, ..TOLD };
        let why = build(&simulation(&format!("{seal}{curve}")), &UNPROGRAMMED, &told).expect_err("refused");
        let message = why.to_string();
        assert!(
            message.starts_with("curve (form velocity) cannot run on the block: it is a force along velocity"),
            "{message}"
        );
        let NoImage::Refused(refused) = &why else { panic!("{why}") };
        assert_eq!(refused.len(), 1);
        assert!(refusal_json(refused).contains("\"curve\""));
    }
}

/// Every form of every mechanism of the library is either carried or refused with a reason; none is dropped.
#[test]
fn no_mechanism_is_dropped_silently() {
    use simulation::mechanism::{Added, ShapeParameter, library};
    let (mut carried, mut refused) = (0, 0);
    for definition in library() {
        for (form, own) in definition.forms.iter().enumerate() {
            let mut simulation = simulation("");
            let middle = |s: &ShapeParameter| match s.name {
                // a stroke of a metre
                "from_m" => 0.0,
                "to_m" => 1.0,
                _ => (s.from * s.to).abs().sqrt().clamp(s.from, s.to),
            };
            let shape = own.shape.iter().map(middle).collect();
            let amplitudes = own.amplitudes.iter().map(|a| 0.5 * a.typical).collect();
            simulation.mechanisms = vec![Added { id: definition.id, form, shape, amplitudes }];
            match build(&simulation, &UNPROGRAMMED, &TOLD) {
                Ok(image) => {
                    carried += 1;
                    assert_eq!(image.carried.len(), 1);
                    let params = image.record.params;
                    let acts = !params.left_out.acting().is_empty();
                    let waits = params.presliding_guard_m > UNPROGRAMMED.params.presliding_guard_m
                        || image.carried[0].how.starts_with("no estimates for");
                    assert!(acts || waits, "{} {}: {:?}", definition.id, own.name, image.carried);
                }
                Err(NoImage::Refused(why)) => {
                    refused += 1;
                    assert!(why.len() == 1 && why[0].id == definition.id.name() && why[0].why.len() > 20, "{why:?}");
                }
                Err(other) => panic!("{} {}: {other}", definition.id, own.name),
            }
        }
    }
    println!("{carried} forms are carried, {refused} refused");
    assert!(carried >= 30, "{carried}");
}

#[test]
fn a_place_without_a_zero_is_refused_and_so_is_the_same_twice() {
    let text = format!(
        "[axis]\nposition_reference = \"relative\"\n{}",
        entry("id = \"ball-pass\"\nwavelength_m = 0.0143\nsine = 0.02\ncosine = 0.0")
    );
    let why = build(&simulation(&text), &UNPROGRAMMED, &TOLD).expect_err("refused").to_string();
    assert!(why.contains("position_reference"), "{why}");
    let seal = entry("id = \"seal-drag\"\ndrag_n = 4.0");
    let other = entry("id = \"seal-drag\"\ndrag_n = 4.5");
    let why = build(&simulation(&format!("{seal}{other}")), &UNPROGRAMMED, &TOLD).expect_err("refused").to_string();
    assert!(why.contains("twice"), "{why}");
    let why = build(&Simulation::of(Law::COLUMN), &UNPROGRAMMED, &TOLD).expect_err("no guide").to_string();
    assert!(why.contains("ball guide"), "{why}");
}

#[test]
fn the_block_s_own_record_lends_its_sensors() {
    let mut base = UNPROGRAMMED;
    base.node = 9;
    base.params.calibrated = true;
    base.params.seals.coulomb_n = 2.0;
    base.params.calibration.force.zero_code = 2051.0;
    let image = build(&simulation(&entry("id = \"seal-drag\"\ndrag_n = 4.0")), &base, &TOLD).expect("legal");
    let made = crate::parameters::from_bytes(&image.bytes).expect("readable");
    assert_eq!(made, image.record);
    assert_eq!((made.node, made.params.calibrated), (9, true));
    assert_eq!(made.params.calibration, base.params.calibration);
    // all seals are the simulation's
    assert_eq!((made.params.seals.coulomb_n, made.params.left_out.seal.coulomb_n), (0.0, [4.0; 2]));
    assert_eq!(Some(image.hash), image_hash(&image.bytes));
    let page = describe(&image.bytes).expect("readable");
    assert!(page.starts_with(&format!("# image {:08x}", image.hash)) && page.contains("seal"), "{page}");
    // the page is a bench file of the same record
    assert_eq!(crate::parameters::from_bench(&page).expect("a bench file"), image.record);
    assert!(described_json(&image.bytes).expect("readable").contains("\"left_out\""));
    assert!(to_json(&image).contains("\"carried\": \"seal\""));
}
