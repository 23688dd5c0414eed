//! [`Sink`]: who takes the results of a run as they come.

use std::io;

use crate::integrate::Flow;

/// Takes the results of a run as they come. The one stepping loop, that of [`super::Run`], tells its sink and nobody else.
pub trait Sink: Send {
    /// The channels at one of the sample times of the scene, counted from 0, in SI units and in the order of the model. They
    /// come in order, each after the last step that it depends on was found good.
    ///
    /// # Errors
    /// An error ends the run.
    fn sample(&mut self, number: usize, values: &[f64]) -> io::Result<()>;

    /// A step was accepted that ends at a time, s. Tells whether to go on.
    fn step(&mut self, t: f64) -> Flow {
        let _ = t;
        Flow::Continue
    }
}
