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
use seixo::error::{Error, Problem};
use serde::Deserialize;
use std::collections::BTreeSet;

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

/// The error of the table `kind` called `name`, which asks for a `curve` that is none of `curves`.
pub fn missing(kind: &str, name: &str, curve: &str, curves: &BTreeSet<String>) -> Option<Error> {
    if curves.contains(curve) {
        return None;
    }
    let known: Vec<&str> = curves.iter().map(String::as_str).collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    let text = format!("{kind} `{name}`: there is no curve `{curve}`; there are: {known}");
    Some(Error::key(kind, text, "name a curve that [measure] takes"))
}

impl ResultNumber {
    /// What is wrong with it, if anything, with the key in its table.
    pub fn fault(&self) -> Option<Problem> {
        if matches!(self.take, Take::Distance | Take::Lag) {
            let remedy = "write a [[check]], which knows `against` and `behind`, or take something else";
            return Some(Problem::new("take", "it asks for a second curve", remedy));
        }
        self.take.fault([self.level, self.to], self.window, self.smooth)
    }

    /// What is wrong where `curves` are all that a point has, if its own is none of them: a mistake of the study.
    pub fn lacks(&self, curves: &BTreeSet<String>) -> Option<Error> {
        missing("result", &self.name, &self.curve, curves)
    }

    /// Puts the number among what a run `measured`. What does not come to pass in a run, such as a passage, leaves its cell empty.
    pub fn put(&self, measured: &mut Measured) {
        // A gauge that has never had a value has no curve.
        let Some(curve) = measured.curve(&self.curve).filter(|_| measured.class <= Class::Degraded) else {
            return;
        };
        let curve = prepared(self.take, curve, self.since_moved, self.smooth);
        let reduced = if measured.profiles.contains(&self.curve) { reduce_bins } else { reduce };
        let levels = [self.level, self.to].map(Option::unwrap_or_default);
        let number = |(curve, _): (Curve, f64)| reduced(self.take, &cut(&curve, self.window), levels);
        if let Some(value) = curve.and_then(number) {
            measured.put(&self.name, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_that_no_point_can_have_is_told_with_those_that_there_are() {
        let number: ResultNumber = toml::from_str("name = \"n\"\ncurve = \"c\"\ntake = \"mean\"").unwrap();
        let curves = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        assert!(number.lacks(&curves(&["b", "c"])).is_none());
        let told = number.lacks(&curves(&["b", "d"])).unwrap().to_string();
        assert!(told.contains("there is no curve `c`; there are: b, d"), "{told}");
        // A gauge that was dry all the time has none either, which is no mistake.
        let mut measured = Measured::default();
        number.put(&mut measured);
        assert_eq!(measured, Measured::default());
    }

    #[test]
    fn what_a_number_asks_for_has_to_be_there() {
        let fault = |more: &str| {
            let text = format!("name = \"n\"\ncurve = \"c\"\n{more}");
            toml::from_str::<ResultNumber>(&text).expect("it reads").fault()
        };
        for (more, key) in [
            ("take = \"first_below\"", "level"),
            ("take = \"at\"", "level"),
            ("take = \"passage\"\nlevel = 1", "to"),
            ("take = \"mean\"\nwindow = [0.3, 0.1]", "window"),
            ("take = \"mean\"\nsmooth = -1", "smooth"),
            ("take = \"lag\"", "take"),
        ] {
            let told = fault(more).expect(more);
            assert!(told.key == key && !told.remedy.is_empty(), "{more}: {told:?}");
        }
        for more in ["take = \"mean\"", "take = \"at\"\nlevel = 0", "take = \"passage\"\nlevel = 1\nto = 2"] {
            assert!(fault(more).is_none(), "{more}");
        }
    }
}
