//! Going on from where a run ended.

use super::*;

fn folder(name: &str) -> std::path::PathBuf {
    let folder = std::env::temp_dir().join(format!("odyn-restart-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A driven pendulum with a discrete state, a continuous state, and an angle that goes over many turns.
fn wheel(t_end: f64, engine: &str) -> String {
    settings(&format!("t_end = {t_end:?}; output_step = 0.1; engine = \"{engine}\""))
        + "[[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.1, 0.1, 0.2]\nangular_velocity = [0, 0, 30]\n\
           [[joint]]\nname = \"pivot\"\ntype = \"hinge\"\nbodies = [\"ground\", \"wheel\"]\npoint = [0.1, 0, 0]\naxis = [0, 0, 1]\n\
           [[force]]\nname = \"lag\"\ntype = \"lag\"\nbodies = [\"wheel\"]\nparams.tau = 2.0\n\
           [[force]]\nname = \"tally\"\ntype = \"tally\"\nbodies = [\"wheel\"]\n"
        + &output("phi", "quantity = \"coordinate\"; of = \"pivot\"")
        + &output("steps", "quantity = \"value\"; of = \"tally\"; channel = \"steps\"")
        + &output("lagging", "quantity = \"value\"; of = \"lag\"")
}

#[test]
fn a_run_in_two_parts_ends_where_one_run_ends() {
    for engine in ["interpreted", "reference"] {
        let first_folder = folder(engine);
        let whole = run(&wheel(4.0, engine));
        let first = open(&wheel(2.0, engine)).run(Some(&first_folder), Box::new(|_| ()), &Arc::default()).unwrap();
        let state = Restart::read(&first_folder).unwrap();
        assert_eq!(state.time, 2.0);
        let steps = state.discrete[0];
        let mut second = open(&wheel(4.0, engine));
        second.go_on_from(state).unwrap();
        let second = second.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
        assert_eq!((second.times[0], *second.times.last().unwrap()), (2.0, 4.0));
        // 2 s with 30 rad/s are 9.5 turns: the angle continues, it does not start anew.
        let joined = column(&second, "phi")[0];
        assert!((joined - column(&first, "phi").last().unwrap()).abs() < 1e-12 && joined > 59.9, "{joined}");
        // Samples at the end of a step are taken before it is counted.
        assert_eq!((column(&second, "steps")[0], column(&first, "steps").last()), (steps, Some(&(steps - 1.0))));
        for name in ["phi", "lagging"] {
            let (one, two) = (column(&whole, name).last().unwrap(), column(&second, name).last().unwrap());
            assert!((one - two).abs() < 1e-9 * one.abs().max(1.0), "{name}: {one} or {two}");
        }
        std::fs::remove_dir_all(first_folder).unwrap();
    }
}

#[test]
fn states_come_back_bit_by_bit() {
    let text = wheel(1.0, "interpreted");
    let session = open(&text);
    let numbers = vec![0.1 + 0.2, 1.0 / 3.0, -5e-324, 1.7e308, 6.02e23];
    let mut state = Restart::new(&session.model, 1.0 / 3.0, numbers, &[0.1], &[-0.0, 2.0]);
    state.memories.push(("tally".into(), vec![0, 255, 7]));
    let at = folder("bits");
    state.write(&at).unwrap();
    let found = Restart::read(&at).unwrap();
    std::fs::remove_dir_all(at).unwrap();
    assert_eq!(found, state);
    let bits = |list: &[f64]| list.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&found.working), bits(&state.working));
}

#[test]
fn states_that_do_not_fit_are_refused() {
    let state = |text: &str| {
        let session = open(text);
        let a = &session.assembly;
        Restart::new(&session.model, 1.0, a.working.clone(), &a.references, &a.discrete)
    };
    let text = wheel(2.0, "interpreted");
    let refusal = |state: Restart| open(&text).go_on_from(state).map_err(|e| e.to_string()).unwrap_err();
    let other = refusal(state(&scenes::pendulum("")));
    assert!(other.contains("belongs to another scene: it has the body `"), "{other}");
    let mut renamed = state(&text);
    renamed.elements.iter_mut().filter(|name| *name == "lag").for_each(|name| *name = "delay".into());
    let renamed = refusal(renamed);
    assert!(renamed.contains("it has the element `delay`, which this scene has not"), "{renamed}");
    let mut turned = state(&text);
    turned.elements.reverse();
    assert!(refusal(turned).contains("its elements are in another order"));
    // An input that was there, with the same bodies and elements.
    let inputs = refusal(state(&(text.clone() + "[[input]]\nname = \"wind\"\nvalue = 1\n")));
    assert!(inputs.contains("it has 1 `[[input]]`, this scene 0") && inputs.contains("as many"), "{inputs}");
    let mut memory = state(&text);
    memory.working.push(0.0);
    assert!(refusal(memory).contains("other states"));
    assert!(refusal(Restart { time: 2.0, ..state(&text) }).contains("not before this scene's end"));
    let mut broken = state(&text);
    broken.working[3] = f64::NAN;
    assert!(refusal(broken).contains("not finite"));
    assert!(open(&text).go_on_from(state(&text)).is_ok());
    let missing = Restart::read(std::path::Path::new("no such folder")).unwrap_err();
    assert!(missing.message.contains("cannot continue from"), "{missing:?}");
}

#[test]
fn inputs_keep_what_they_had_unless_the_scene_gives_another_value() {
    let pushed = |value: f64| {
        wheel(4.0, "interpreted")
            + &format!("[[input]]\nname = \"wind\"\nvalue = {value:?}\n")
            + &output("gust", "quantity = \"input\"; of = \"wind\"")
    };
    let of_scene = open(&pushed(1.5));
    let at = of_scene.plan.layout.given_at;
    let assembly = &of_scene.assembly;
    let mut left =
        Restart::new(&of_scene.model, 2.0, assembly.working.clone(), &assembly.references, &assembly.discrete);
    // What a program gave it while it ran.
    left.discrete[at] = -4.0;
    for (value, expected) in [(1.5, -4.0), (7.0, 7.0), (-4.0, -4.0)] {
        let mut next = open(&pushed(value));
        next.go_on_from(left.clone()).unwrap();
        let found = next.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
        assert_eq!(column(&found, "gust")[0], expected, "{value}");
    }
}
