//! The equations of motion as a function of time and state, and what of a run can be written later.

use super::*;
use crate::analysis::Group;

/// A body on a rail along x, pushed by an input and held by a spring of 50 N/m by way of a signal.
fn cart(keys: &str) -> String {
    settings(&format!("t_end = 2; output_step = 0.25; {keys}"))
        + "[[body]]\nname = \"cart\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nposition = [0.3, 0, 0]\n\
           [[joint]]\nname = \"rail\"\ntype = \"slide\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
           [[input]]\nname = \"motor\"\nvalue = 4\nunit = \"N\"\n\
           [[force]]\nname = \"spring\"\ntype = \"push\"\nbodies = [\"ground\", \"cart\"]\nparams.factor = -50\n\
           inputs.signal = \"x\"\n\
           [[force]]\nname = \"push\"\ntype = \"push\"\nbodies = [\"ground\", \"cart\"]\nparams.factor = 1\n\
           inputs.signal = \"motor\"\n"
        + &output("x", "quantity = \"position\"; of = \"cart\"; component = \"x\"")
        + &output("v", "quantity = \"velocity\"; of = \"cart\"; component = \"x\"")
}

#[test]
fn it_is_the_motion_and_its_derivatives() {
    for keys in ["formulation = \"joint\"", "formulation = \"cartesian\""] {
        // Implicit methods have exact derivatives prepared.
        let mut side = open(&cart(&format!("method = \"radau5\"; {keys}"))).prepare().unwrap().right_side().unwrap();
        let start = side.start().to_vec();
        assert_eq!((side.span(), side.groups().len()), ([0.0, 2.0], start.len()));
        let place = side.groups().iter().position(|group| matches!(group, Group::Position)).unwrap();
        let speed = side.groups().iter().position(|group| matches!(group, Group::Velocity)).unwrap();
        // 2 v' = F - 50 x.
        let rates = side.rates(0.0, &start).unwrap();
        assert!((rates[speed] + 0.5 * 11.0).abs() < 1e-12 && rates[place] == 0.0, "{keys}: {rates:?}");
        let derivatives = side.jacobian(0.0, &start).unwrap().unwrap();
        let entry = |row: usize, column: usize| derivatives[row + start.len() * column];
        assert!((entry(speed, place) + 25.0).abs() < 1e-9 && (entry(place, speed) - 1.0).abs() < 1e-12, "{keys}");
        side.set_input("motor", 16.0).unwrap();
        assert!((side.rates(0.0, &start).unwrap()[speed] - 0.5).abs() < 1e-12, "{keys}");
        let mut moved = start.clone();
        moved[place] += 0.1;
        let outputs = side.outputs(1.0, &moved).unwrap();
        assert!((outputs[0] - 0.4).abs() < 1e-15 && outputs[1] == 0.0, "{keys}: {outputs:?}");
        // Whatever was asked before, the answer is the same.
        let again = side.rates(0.0, &start).unwrap();
        side.rates(7.0, &moved).unwrap();
        assert_eq!(side.rates(0.0, &start).unwrap(), again);
        assert!(side.rates(0.0, &start[1..]).unwrap_err().to_string().contains("finite numbers"));
    }
}

#[test]
fn what_is_off_the_joints_is_brought_back() {
    let mut side = open(&cart("formulation = \"cartesian\"")).prepare().unwrap().right_side().unwrap();
    let mut off = side.start().to_vec();
    let places: Vec<usize> = (0..off.len()).filter(|k| side.groups()[*k] == Group::Position).collect();
    off[places[1]] += 1e-3;
    let back = side.project(0.0, &off).unwrap();
    assert!(back[places[1]].abs() < 1e-12, "{back:?}");
}

#[test]
fn a_report_writes_the_files_that_its_run_would_have() {
    let folders = ["odyn-report-written", "odyn-report-later"].map(|name| {
        let folder = std::env::temp_dir().join(format!("{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        folder
    });
    let text = cart("") + "[units]\nlength = \"mm\"\ntime = \"ms\"\n";
    let with_units = text.replace("t_end = 2", "t_end = 2000").replace("output_step = 0.25", "output_step = 0.7");
    let written = open(&with_units).run(Some(&folders[0]), Box::new(|_| ()), &Arc::default()).unwrap();
    run(&with_units).write(&folders[1]).unwrap();
    for name in ["results.csv", "channels.json"] {
        let [now, later] = [0, 1].map(|k| std::fs::read(folders[k].join(name)).unwrap());
        assert_eq!(now, later, "{name}");
    }
    assert!(
        written.times.len() > 2000
            && std::fs::read_to_string(folders[1].join("summary.json")).unwrap().contains("results_sha256")
    );
    folders.iter().for_each(|folder| std::fs::remove_dir_all(folder).unwrap());
}
