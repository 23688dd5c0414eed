//! The figures and checks of a scene, from the samples of its run.

use super::common::Tables;
use super::opened::Session;
use super::outcome::RunReport;
use super::samplings::Samplings;
use crate::results::{ChannelInfo, CheckResult, Crossing, Figure, FigureResult, Samples, Summary, Take};
use crate::scene::{Dimension, Scene};

impl Session {
    /// Figures and checks of the samples, written into a summary; the checks with their samples. The tables are those of
    /// [`Session::tables`].
    pub(super) fn evaluate(&self, summary: &mut Summary, samplings: &Samplings, tables: &Tables) -> Vec<CheckResult> {
        summary.rows = samplings.rows();
        summary.figures = figures(&self.scene, &samplings.taken, &samplings.columns, &samplings.channels);
        let checks = self.checks(tables, &samplings.taken, &samplings.columns);
        summary.checks = checks.iter().map(CheckResult::without_samples).collect();
        checks
    }
}

impl RunReport {
    /// The figures of its scene as they are on these of its samples alone.
    #[must_use]
    pub fn figures_at(&self, scene: &Scene, samples: &[usize]) -> Vec<FigureResult> {
        let taken =
            |all: &Vec<f64>| samples.iter().filter_map(|sample| all.get(*sample)).copied().collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = self.columns.iter().map(taken).collect();
        figures(scene, &taken(&self.times), &columns, &self.channels)
    }
}

/// A scene's derived figures.
fn figures(scene: &Scene, times: &[f64], columns: &[Vec<f64>], channels: &[ChannelInfo]) -> Vec<FigureResult> {
    let names: Vec<String> = channels.iter().map(|c| c.name.clone()).collect();
    let samples = Samples { times, columns, names: &names };
    let unit = scene.units.factor(Dimension::TIME);
    let mut results = Vec::new();
    for record in &scene.figures {
        let find =
            |name: &str| names.iter().position(|n| n == name).ok_or_else(|| format!("there is no output `{name}`"));
        let figure = || -> Result<Figure, String> {
            let channel = find(&record.channel.value)?;
            let take = match record.take {
                crate::scene::Take::Peak => Take::Peak,
                crate::scene::Take::Min => Take::Min,
                crate::scene::Take::Max => Take::Max,
                crate::scene::Take::Final => Take::Final,
                crate::scene::Take::Mean => Take::Mean,
                crate::scene::Take::Rms => Take::Rms,
                crate::scene::Take::At => {
                    let at = record.at.as_ref().ok_or("needs `where` and `equals`")?;
                    let own = find(&at.channel.value)?;
                    let info = &channels[own];
                    let (dimension, _) = crate::scene::parse_unit(&info.unit).map_err(|e| e.message)?;
                    let value = |raw| scene.quantity(raw, dimension).map_err(|d| d.message);
                    Take::At(Crossing {
                        channel: own,
                        equals: info.from_si(value(&at.equals)?),
                        period: at.period.as_ref().map(value).transpose()?.map(|p| info.from_si(p)),
                    })
                }
            };
            let over = record.over.as_ref().map(|name| find(&name.value)).transpose()?;
            let from = record.from.map(|t| t / unit);
            Ok(Figure { channel, take, absolute: record.absolute, over, from })
        };
        let computed = figure().and_then(|figure| figure.compute(&samples).map_err(|error| error.to_string()));
        let (value, problem) = match computed {
            Ok(value) => (Some(value), None),
            Err(problem) => (None, Some(problem)),
        };
        // Also where it has no value.
        let own = channels.iter().find(|channel| channel.name == record.channel.value);
        let unit = match own {
            Some(own) if record.unit.value.is_empty() && record.over.is_none() => own.unit.clone(),
            _ => record.unit.value.clone(),
        };
        results.push(FigureResult {
            name: record.name.value.clone(),
            value,
            published: record.published,
            unit,
            note: record.note.clone(),
            problem,
        });
    }
    results
}
