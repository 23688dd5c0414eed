//! Machine code of the equations of scenes: the interpreter's numbers, bit for bit, opaque calls between stages included.

#[path = "../../../../testing/machine.rs"]
mod twins;

use super::*;
use crate::tests::{Prepared, prepared, scenes};
use twins::{assert_same, by_machine, makers};

/// Everything the equations of a scene contain, opaque calls between stages included.
#[test]
fn programs_of_scenes_give_the_same_bits() {
    let bent = scenes::four_bar(1.1);
    for text in [scenes::tangle(), scenes::opaque_tangle(), bent] {
        let Prepared { model, equations, plan, .. } = prepared(&text);
        let mut nodes = equations.loads.clone();
        nodes.extend(&equations.state_rates);
        nodes.extend([equations.power, equations.kinetic, equations.potential]);
        for row in equations.rows.iter() {
            nodes.extend([row.value, row.time, row.gamma]);
            nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
        }
        let program = Program::compile(&equations.graph, &nodes);
        assert_eq!(program.calls() > 0, model.elements.iter().any(|element| element.class.opaque));
        let mut random = Random(29);
        for maker in makers(&[13, 256, usize::MAX]) {
            let machine = by_machine(&program, maker);
            let (mut a, mut b) = (program.workspace(), machine.workspace());
            let (mut expected, mut found) = (vec![0.0; nodes.len()], vec![0.0; nodes.len()]);
            for _ in 0..3 {
                let inputs = Motion::random(&plan.layout, &mut random).start;
                program.run(&inputs, &model.sets, &mut a, &mut expected).unwrap();
                machine.run(&inputs, &model.sets, &mut b, &mut found).unwrap();
                assert_same(&found, &expected);
            }
            assert_eq!((a.runs(), b.runs()), (3, 3));
        }
    }
}
