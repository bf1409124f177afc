//! Numbers, thresholds, and the verdicts that follow from them.

/// What came of a claim. No verdict is written by hand: a [`Finding`] carries the one that its numbers allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// As printed.
    Reproduced,
    /// A slip in print: the right form is confirmed, the printed one is not.
    Corrected,
    /// A counterexample was computed.
    Refuted,
    /// Left open, or not said, in the paper and decided here.
    Settled,
    /// As printed as far as the numbers go; the remark names what they leave out.
    InPart,
    /// Numbers, and nothing in print that they could be held against.
    NotDecided,
    /// Cannot be computed in this run; the remark says why.
    NotReproducible,
    /// A number is on the wrong side of its threshold.
    NotConfirmed,
}

impl Verdict {
    pub const ALL: [Verdict; 8] = [
        Verdict::Reproduced,
        Verdict::Corrected,
        Verdict::Refuted,
        Verdict::Settled,
        Verdict::InPart,
        Verdict::NotDecided,
        Verdict::NotReproducible,
        Verdict::NotConfirmed,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Verdict::Reproduced => "reproduced",
            Verdict::Corrected => "corrected",
            Verdict::Refuted => "refuted",
            Verdict::Settled => "settled",
            Verdict::InPart => "in part",
            Verdict::NotDecided => "not decided",
            Verdict::NotReproducible => "not reproducible",
            Verdict::NotConfirmed => "not confirmed",
        }
    }
}

/// A measured quantity, by how it is compared with the committed one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Number(f64),
    /// Iterations and the like, which may differ by one between machines.
    Count(usize),
    /// Seconds or their ratios, which nobody can compare.
    Time(f64),
}

impl Value {
    pub fn number(self) -> f64 {
        match self {
            Value::Number(x) | Value::Time(x) => x,
            Value::Count(n) => n as f64,
        }
    }
}

impl From<f64> for Value {
    fn from(x: f64) -> Self {
        Value::Number(x)
    }
}

impl From<usize> for Value {
    fn from(n: usize) -> Self {
        Value::Count(n)
    }
}

/// What a value has to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    AtMost,
    Below,
    AtLeast,
    Above,
    Equal,
}

impl Relation {
    pub fn sign(self) -> &'static str {
        match self {
            Relation::AtMost => "≤",
            Relation::Below => "<",
            Relation::AtLeast => "≥",
            Relation::Above => ">",
            Relation::Equal => "=",
        }
    }
}

/// A measured number, and the threshold that it is held against where it decides anything.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Unique within its claim.
    pub quantity: String,
    pub value: Value,
    pub test: Option<(Relation, f64)>,
}

impl Evidence {
    fn new(quantity: impl Into<String>, value: impl Into<Value>, test: Option<(Relation, f64)>) -> Self {
        Evidence { quantity: quantity.into(), value: value.into(), test }
    }

    pub fn at_most(quantity: impl Into<String>, value: impl Into<Value>, threshold: f64) -> Self {
        Self::new(quantity, value, Some((Relation::AtMost, threshold)))
    }

    pub fn below(quantity: impl Into<String>, value: impl Into<Value>, threshold: f64) -> Self {
        Self::new(quantity, value, Some((Relation::Below, threshold)))
    }

    pub fn at_least(quantity: impl Into<String>, value: impl Into<Value>, threshold: f64) -> Self {
        Self::new(quantity, value, Some((Relation::AtLeast, threshold)))
    }

    pub fn above(quantity: impl Into<String>, value: impl Into<Value>, threshold: f64) -> Self {
        Self::new(quantity, value, Some((Relation::Above, threshold)))
    }

    pub fn equal(quantity: impl Into<String>, value: impl Into<Value>, wanted: f64) -> Self {
        Self::new(quantity, value, Some((Relation::Equal, wanted)))
    }

    /// A number that is told and decides nothing.
    pub fn shown(quantity: impl Into<String>, value: impl Into<Value>) -> Self {
        Self::new(quantity, value, None)
    }

    /// Whether the value is what it has to be; a NaN never is. `None` for a number that decides nothing.
    pub fn holds(&self) -> Option<bool> {
        let (relation, threshold) = self.test?;
        let value = self.value.number();
        Some(match relation {
            Relation::AtMost => value <= threshold,
            Relation::Below => value < threshold,
            Relation::AtLeast => value >= threshold,
            Relation::Above => value > threshold,
            Relation::Equal => value == threshold,
        })
    }
}

/// The numbers of a claim with the verdict that they are meant to support.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    intended: Verdict,
    pub evidence: Vec<Evidence>,
    pub remark: String,
}

impl Finding {
    fn new(intended: Verdict, evidence: Vec<Evidence>) -> Self {
        Finding { intended, evidence, remark: String::new() }
    }

    /// Confirms what is printed.
    pub fn reproduced(evidence: Vec<Evidence>) -> Self {
        Self::new(Verdict::Reproduced, evidence)
    }

    /// Decides what is left open or not said.
    pub fn settled(evidence: Vec<Evidence>) -> Self {
        Self::new(Verdict::Settled, evidence)
    }

    /// Confirms a part of what is printed; the remark says which part is left.
    pub fn in_part(evidence: Vec<Evidence>, left: impl Into<String>) -> Self {
        Self::new(Verdict::InPart, evidence).remark(left)
    }

    /// Tells what comes of a statement that names nothing to hold it against, for the reason given.
    pub fn not_decided(evidence: Vec<Evidence>, reason: impl Into<String>) -> Self {
        Self::new(Verdict::NotDecided, evidence).remark(reason)
    }

    /// Confirms a counterexample.
    pub fn refuted(counterexample: Vec<Evidence>) -> Self {
        Self::new(Verdict::Refuted, counterexample)
    }

    /// Holds the deviation of the printed form and that of the right one against one threshold: corrected if
    /// right ≤ threshold < printed.
    pub fn corrected(deviation: &str, printed: f64, right: f64, threshold: f64) -> Self {
        Self::new(
            Verdict::Corrected,
            vec![
                Evidence::above(format!("{deviation}, as printed"), printed, threshold),
                Evidence::at_most(format!("{deviation}, put right"), right, threshold),
            ],
        )
    }

    /// A claim that this run cannot compute.
    pub fn not_reproducible(reason: impl Into<String>) -> Self {
        Self::new(Verdict::NotReproducible, Vec::new()).remark(reason)
    }

    /// Further numbers; those with a threshold must hold too.
    pub fn also(mut self, evidence: impl IntoIterator<Item = Evidence>) -> Self {
        self.evidence.extend(evidence);
        self
    }

    /// What the numbers do not say by themselves.
    pub fn remark(mut self, text: impl Into<String>) -> Self {
        self.remark = text.into();
        self
    }

    /// The intended verdict if there is a number with a threshold and all such numbers hold, else `not confirmed`. What
    /// decides nothing needs no such number.
    pub fn verdict(&self) -> Verdict {
        let mut tests = self.evidence.iter().filter_map(Evidence::holds).peekable();
        let decides = !matches!(self.intended, Verdict::NotReproducible | Verdict::NotDecided);
        if (tests.peek().is_some() || !decides) && tests.all(|holds| holds) {
            self.intended
        } else {
            Verdict::NotConfirmed
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_verdict_can_be_reached_and_follows_from_the_numbers() {
        let small = || vec![Evidence::at_most("deviation", 1e-15, 1e-12)];
        let reached = [
            Finding::reproduced(small()),
            Finding::corrected("deviation", 0.5, 1e-15, 1e-12),
            Finding::refuted(vec![Evidence::above("ratio", 1.2, 1.0)]),
            Finding::settled(small()),
            Finding::in_part(small(), "the other half"),
            Finding::not_decided(vec![Evidence::shown("error", 0.1)], "no number in print"),
            Finding::not_reproducible("no model"),
            Finding::reproduced(vec![Evidence::at_most("deviation", 1e-3, 1e-12)]),
        ];
        assert_eq!(reached.map(|f| f.verdict()), Verdict::ALL);
    }

    #[test]
    fn a_correction_needs_a_wrong_print_and_a_right_form() {
        let verdict = |printed, right| Finding::corrected("d", printed, right, 1e-9).verdict();
        assert_eq!(verdict(1e-3, 1e-10), Verdict::Corrected);
        assert_eq!(verdict(1e-3, 1e-9), Verdict::Corrected);
        assert_eq!(verdict(1e-10, 1e-10), Verdict::NotConfirmed);
        assert_eq!(verdict(1e-3, 1e-3), Verdict::NotConfirmed);
        assert_eq!(verdict(f64::NAN, 0.0), Verdict::NotConfirmed);
        assert_eq!(verdict(1.0, f64::NAN), Verdict::NotConfirmed);
    }

    #[test]
    fn one_failing_number_is_enough_and_none_is_too_few() {
        let good = Evidence::equal("count", 0_usize, 0.0);
        let bad = Evidence::below("radius", 1.0, 1.0);
        let finding = Finding::settled(vec![good.clone()]);
        assert_eq!(finding.verdict(), Verdict::Settled);
        assert_eq!(finding.also([bad]).verdict(), Verdict::NotConfirmed);
        let nothing = Finding::settled(vec![Evidence::shown("size", 3_usize)]);
        assert_eq!(nothing.verdict(), Verdict::NotConfirmed);
        let with = nothing.also([good]);
        assert_eq!(with.verdict(), Verdict::Settled);
        // A part needs a number as well; what decides nothing does not, but none may fail.
        let [shown, bad] = [Evidence::shown("size", 3_usize), Evidence::below("radius", 1.0, 1.0)];
        assert_eq!(Finding::in_part(vec![shown.clone()], "").verdict(), Verdict::NotConfirmed);
        assert_eq!(Finding::not_decided(vec![shown, bad], "").verdict(), Verdict::NotConfirmed);
    }

    #[test]
    fn the_relations_are_strict_where_they_say_so() {
        let at = |value: f64| {
            [
                Evidence::at_most("", value, 1.0),
                Evidence::below("", value, 1.0),
                Evidence::at_least("", value, 1.0),
                Evidence::above("", value, 1.0),
                Evidence::equal("", value, 1.0),
            ]
            .map(|e| e.holds() == Some(true))
        };
        assert_eq!(at(0.5), [true, true, false, false, false]);
        assert_eq!(at(1.0), [true, false, true, false, true]);
        assert_eq!(at(2.0), [false, false, true, true, false]);
        assert_eq!(at(f64::NAN), [false; 5]);
        assert_eq!(Evidence::shown("", 1.0).holds(), None);
    }
}
