//! A number that a study tells of every point, without anything to hold it against.
//!
//! ```toml
//! [[result]]
//! name = "mean force on the gate [N]"
//! curve = "gate_force_x [N]"
//! take = "mean"                          # see [`Take`]
//! window = [0.5, 1.0]
//! ```

use super::row::{Class, Measured};
use super::validation::reduce::{Curve, Take, cut, prepared, reduce, reduce_bins};
use seixo::error::{Error, Result};
use serde::Deserialize;
use std::cmp::Ordering;

/// What is told.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ResultNumber {
    /// Name of the column, with its unit.
    pub name: String,
    /// A measured curve.
    pub curve: String,
    /// What is taken from the curve.
    pub take: Take,
    /// First and last time (or place) that counts.
    pub window: Option<[f64; 2]>,
    /// Width of the moving mean that the curve goes through [s]; 0 for none.
    #[serde(default)]
    pub smooth: f64,
    /// Level or time that `take` asks for.
    pub level: Option<f64>,
    /// Second level, of `passage`.
    pub to: Option<f64>,
    /// Time counts from the moment at which the curve has moved by this much from its start.
    pub since_moved: Option<f64>,
}

impl ResultNumber {
    /// What is wrong with it, if anything.
    ///
    /// # Errors
    /// [`Error::Case`] naming it.
    pub fn sound(&self) -> Result<()> {
        if matches!(self.take, Take::Distance | Take::Lag) {
            let text = format!("result `{}`: `take` asks for a second curve: that is a [[check]]", self.name);
            return Err(Error::key("result", text, ""));
        }
        let wrong = |what: &str, remedy: &str| {
            Err(Error::key("result", format!("result `{}`: {what}", self.name), remedy))
        };
        let (levelled, passes) = match self.take {
            Take::FirstAbove | Take::FirstBelow | Take::At => (true, false),
            Take::Passage => (true, true),
            _ => (false, false),
        };
        if levelled && !self.level.is_some_and(f64::is_finite) {
            return wrong(
                "`take` asks for a `level`",
                "give `level`: the level that is crossed, or the time of `at`",
            );
        }
        if passes && !self.to.is_some_and(f64::is_finite) {
            return wrong("`take = \"passage\"` asks for a second level", "give `to`");
        }
        if !(self.smooth.is_finite() && self.smooth >= 0.0) {
            return wrong("`smooth` is a width of time, 0 or more", "");
        }
        if self.window.is_some_and(|[from, to]| from.partial_cmp(&to) != Some(Ordering::Less)) {
            return wrong("`window` ends before it begins", "give its first time, then its last");
        }
        Ok(())
    }

    /// Puts the number among what a run `measured`. A curve that is not there is a mistake of the study; what does not come to pass in
    /// a run, such as a passage, leaves its cell empty.
    ///
    /// # Errors
    /// [`Error::Case`] with the curves that there are.
    pub fn put(&self, measured: &mut Measured) -> Result<()> {
        if measured.class > Class::Degraded {
            return Ok(());
        }
        let Some(curve) = measured.curve(&self.curve) else {
            let known: Vec<&str> = measured.curves.keys().map(String::as_str).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            let text =
                format!("result `{}`: there is no curve `{}`; there are: {known}", self.name, self.curve);
            return Err(Error::key("result", text, "name a curve that [measure] takes"));
        };
        let curve = prepared(curve, self.since_moved, self.smooth);
        let reduced = if measured.profiles.contains(&self.curve) { reduce_bins } else { reduce };
        let levels = [self.level, self.to].map(Option::unwrap_or_default);
        let number = |(curve, _): (Curve, f64)| reduced(self.take, &cut(&curve, self.window), levels);
        if let Some(value) = curve.and_then(number) {
            measured.put(&self.name, value);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_number_asks_for_has_to_be_there() {
        let sound = |more: &str| {
            let text = format!("name = \"n\"\ncurve = \"c\"\n{more}");
            toml::from_str::<ResultNumber>(&text).expect("it reads").sound().map_err(|e| e.to_string())
        };
        for (more, word) in [
            ("take = \"first_below\"", "level"),
            ("take = \"at\"", "level"),
            ("take = \"passage\"\nlevel = 1", "second level"),
            ("take = \"mean\"\nwindow = [0.3, 0.1]", "window"),
            ("take = \"mean\"\nsmooth = -1", "smooth"),
        ] {
            let told = sound(more).expect_err(more);
            assert!(told.contains("result `n`") && told.contains(word), "{more}: {told}");
        }
        for more in ["take = \"mean\"", "take = \"at\"\nlevel = 0", "take = \"passage\"\nlevel = 1\nto = 2"] {
            assert!(sound(more).is_ok(), "{more}");
        }
    }
}
