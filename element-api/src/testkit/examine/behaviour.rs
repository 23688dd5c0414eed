//! What all elements must do whatever they are: repeat, save and load, share, allocate nothing, follow their angles.

use super::*;

impl Examination<'_> {
    pub(super) fn repeatability(&mut self, setting: &Setting) {
        let other = self.setting();
        let memory = self.probe.set.save(0);
        let once = self.probe.raw(setting);
        let _ = self.probe.raw(&other);
        if bits(&self.probe.raw(setting)) != bits(&once) {
            self.report.add(Check::Repeatability, "the same inputs give other results the next time");
        }
        if self.probe.set.save(0) != memory {
            self.report.add(Check::Repeatability, "an evaluation changes the memory; only `accept` may");
        }
    }

    /// Another instance of the element.
    fn another(&self) -> Result<Probe, CreateError> {
        Probe::of(self.class.as_ref(), self.params)
    }

    pub(super) fn save_load(&mut self) {
        let (Ok(mut old), Ok(mut new)) = (self.another(), self.another()) else { return };
        let settings: Vec<Setting> = (0..10).map(|k| Setting { time: f64::from(k) * 0.1, ..self.setting() }).collect();
        let before = (old.set.save(0), bits(&old.raw(&settings[9])));
        let accept = |probe: &mut Probe, settings: &[Setting]| {
            settings.iter().try_for_each(|setting| probe.set.accept(0, &setting.inputs()))
        };
        if let Err(fault) = accept(&mut old, &settings[..4]) {
            self.report.add(Check::SaveLoad, format!("accept fails: {fault}"));
            return;
        }
        if !old.descriptor.opaque && (old.set.save(0), bits(&old.raw(&settings[9]))) != before {
            let text =
                "`accept` changes it, but the host calls that for opaque elements only: const OPAQUE: bool = true";
            self.report.add(Check::SaveLoad, text);
            return;
        }
        let saved = match old.set.save(0) {
            Ok(saved) => saved,
            Err(fault) => return self.report.add(Check::SaveLoad, format!("save fails: {fault}")),
        };
        if let Err(fault) = new.set.load(0, &saved) {
            return self.report.add(Check::SaveLoad, format!("load refuses what save gave: {fault}"));
        }
        for (when, more) in [("after loading", 4..4), ("some steps after loading", 4..8)] {
            let failed = [&mut old, &mut new].into_iter().any(|probe| accept(probe, &settings[more.clone()]).is_err());
            let same = |setting: &Setting| bits(&old.raw(setting)) == bits(&new.raw(setting));
            if failed || old.set.save(0) != new.set.save(0) || !settings.iter().all(same) {
                let text = format!("{when}, an instance that loaded a saved memory differs from the one that saved it");
                return self.report.add(Check::SaveLoad, text);
            }
        }
    }

    pub(super) fn two_threads(&mut self) {
        let settings: Vec<Setting> = (0..self.options.tries).map(|_| self.setting()).collect();
        let barrier = Barrier::new(2);
        let (class, params) = (self.class.as_ref(), self.params);
        let work = || {
            barrier.wait();
            fenced(|| {
                let probe = Probe::of(class, params).ok()?;
                let results: Vec<Vec<u64>> = settings.iter().map(|setting| bits(&probe.raw(setting))).collect();
                Some((probe.recording, results))
            })
        };
        let (one, other) = std::thread::scope(|scope| {
            let (one, other) = (scope.spawn(work), scope.spawn(work));
            (one.join(), other.join())
        });
        match (one, other) {
            (Ok(Ok(Some(one))), Ok(Ok(Some(other)))) => {
                if one.0 != other.0 {
                    self.report.add(Check::TwoThreads, "two threads record different equations");
                }
                if one.1 != other.1 {
                    self.report.add(Check::TwoThreads, "two threads compute different results");
                }
            }
            _ => self.report.add(Check::TwoThreads, "fails beside another thread"),
        }
    }

    pub(super) fn allocation(&mut self) {
        let Some(count) = self.options.count else { return };
        let inputs = self.setting().inputs();
        let mut out = self.probe.room();
        let set = self.probe.set.as_ref();
        let mut evaluate = || {
            let wanted = Wanted { jacobian: true, second: true };
            let _ = set.evaluate(&Batch { instances: &[0], inputs: &inputs, wanted }, &mut out);
        };
        evaluate();
        let counted = count(&mut || (0..100).for_each(|_| evaluate()));
        if counted > 0 {
            self.report.add(Check::Allocation, format!("{counted} allocations in 100 evaluations"));
        }
    }

    /// Angles, and results in rad, that follow a rotation one to one at its beginning must follow all of it.
    ///
    /// A joint with a mobility is moved along its coordinates. Without one, each frame in turn is turned about its z axis;
    /// then only the angles of a joint are looked at, because its rows are violated on the way.
    pub(super) fn angle_continuity(&mut self, mobility: Option<&Mobility>) {
        if let Some(mobility) = mobility {
            // Poses that violate the rows from the beginning are another finding.
            let rows = if self.report.failed().contains(&Check::FreeMotion) { 0 } else { self.probe.rows() };
            let base = self.random.frame();
            let q: Vec<f64> = (0..mobility.count).map(|_| self.random.between(-2.0, 2.0)).collect();
            for k in 0..mobility.count {
                let moved = |total: f64| {
                    let mut q = q.clone();
                    q[k] += total;
                    Setting::at_rest(vec![base, mobility.place(&base, &q)])
                };
                self.follow(&moved, true, rows, &|| format!("a motion along coordinate {k} of the mobility"));
            }
            return;
        }
        let start = match self.options.aligned {
            Some(make) => self.completed(make),
            None => {
                let mut setting = self.setting();
                let base = setting.frames.first().copied().unwrap_or_else(|| self.random.frame());
                for frame in &mut setting.frames {
                    *frame = on_common_axis(&base, self.random.between(-2.0, 2.0), self.random.between(-1.0, 1.0));
                }
                setting
            }
        };
        let results = self.probe.descriptor.kind != Kind::Joint;
        for frame in 0..start.frames.len() {
            let moved = |total: f64| {
                let mut setting = start.clone();
                setting.frames[frame] = on_common_axis(&start.frames[frame], total, 0.0);
                setting
            };
            let name = self.probe.descriptor.frames.get(frame).map_or("", |named| named.name.as_str()).to_string();
            self.follow(&moved, results, 0, &|| format!("a rotation of frame `{name}` about its z axis"));
        }
    }

    /// Moves over many turns in steps below half a turn.
    /// The first `rows` rows must stay zero on the way.
    fn follow(&mut self, moved: &dyn Fn(f64) -> Setting, results: bool, rows: usize, by: &dyn Fn() -> String) {
        let mut start = moved(0.0);
        self.probe.settle(&mut start);
        let step = 1e-4;
        let at = |references: &[f64], total: f64| {
            let mut setting = moved(total);
            setting.references = references.to_vec();
            setting.states.clone_from(&start.states);
            setting.memory.clone_from(&start.memory);
            setting.signals.clone_from(&start.signals);
            setting.reactions.clone_from(&start.reactions);
            setting
        };
        let angles = self.probe.descriptor.angles;
        let first = self.probe.angles_and_results(&start);
        let slightly = self.probe.angles_and_results(&at(&start.references, step));
        let slope = |k: usize| (slightly[k] - first[k]) / step;
        let following: Vec<(usize, f64)> = (0..if results { first.len() } else { angles })
            .map(|k| (k, slope(k).round()))
            .filter(|(k, sign)| sign.abs() == 1.0 && (slope(*k) - sign).abs() < 1e-6)
            .collect();
        if following.is_empty() {
            return;
        }
        self.report.examine(Check::AngleContinuity);
        let mut total: f64 = 0.0;
        let mut references = start.references.clone();
        while total < TURNS * std::f64::consts::TAU {
            total += self.random.between(-1.0, 3.1);
            let mut setting = at(&references, total);
            let found = self.probe.angles_and_results(&setting);
            let values = if rows > 0 { self.probe.joint_plain(&setting) } else { Vec::new() };
            if let Some(row) = (0..rows).find(|row| values[*row].abs() > 1e-9 * (1.0 + total.abs())) {
                let name = value_name(&self.probe.recording, row, &self.probe.descriptor);
                let text = format!("after {} by {}, {name} is {}, not 0", by(), number(total), number(values[row]));
                return self.report.add(Check::AngleContinuity, text);
            }
            for (k, sign) in &following {
                let expected = first[*k] + sign * total;
                if (found[*k] - expected).abs() > 1e-9 * (1.0 + total.abs()) {
                    let named = self.probe.descriptor.channels.get(k.wrapping_sub(angles));
                    let what = match named {
                        Some(named) if *k >= angles => format!("`{}`", named.name),
                        _ => format!("angle {k}"),
                    };
                    let text = format!(
                        "after {} by {} rad, {what} is {}, not {}: it jumps, as atan2 alone does; `at.angle` counts turns",
                        by(),
                        number(total),
                        number(found[*k]),
                        number(expected)
                    );
                    return self.report.add(Check::AngleContinuity, text);
                }
            }
            self.probe.refer(&mut setting);
            references = setting.references;
        }
    }
}
