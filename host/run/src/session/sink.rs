//! [`Sink`]: who takes the results of a run as they come.

use std::io;

use crate::integrate::Flow;
use crate::results::Event;

/// Takes the results of a run as they come. The one stepping loop, that of [`super::Run`], reports to its sink and nobody else.
pub trait Sink: Send {
    /// The channels at one of the sample times of the scene, counted from 0, in SI units and in the order of the model. They
    /// come in order, each after the last step that it depends on was found good.
    ///
    /// # Errors
    /// An error ends the run.
    fn sample(&mut self, number: usize, values: &[f64]) -> io::Result<()>;

    /// Whether it takes pictures: [`Sink::picture`] is called only then.
    fn takes_pictures(&self) -> bool {
        false
    }

    /// What a picture of the motion shows at that sample, which was reported just before, SI units and ground axes: per body of the
    /// model the position of the origin of its frame and its Euler parameters, body -> ground, scalar first; then force and torque
    /// of each load (`Model::shown_loads`).
    ///
    /// # Errors
    /// An error ends the run.
    fn picture(&mut self, number: usize, values: &[f64]) -> io::Result<()> {
        let _ = (number, values);
        Ok(())
    }

    /// Something happened to a contact.
    ///
    /// # Errors
    /// An error ends the run.
    fn event(&mut self, event: &Event) -> io::Result<()> {
        let _ = event;
        Ok(())
    }

    /// A step was accepted that ends at a time, s. Returns whether to continue.
    fn step(&mut self, t: f64) -> Flow {
        let _ = t;
        Flow::Continue
    }
}
