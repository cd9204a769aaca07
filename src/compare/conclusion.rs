//! The verdict on a comparison: whether its numbers can be used, and what differs, in one sentence.

use super::{Compared, Comparison};
use crate::fit::{Grade, Verdict};
use crate::measurement::number::with_error;

impl Comparison {
    /// Whether the comparison can be used: what differs, the first reason for doubt, or why it cannot.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        if let Some(refuted) = &self.refuted {
            return Verdict { grade: Grade::Unusable, sentence: refuted.clone() };
        }
        if !self.converged {
            let sentence = format!("The search for the best values came to no end ({}).", self.termination);
            return Verdict { grade: Grade::Unusable, sentence };
        }
        let differences: Vec<String> = self.quantities.iter().filter_map(|q| self.outcome(q)).collect();
        let sentence = match (self.warnings.first(), differences.is_empty()) {
            (Some(first), true) => first.clone(),
            (Some(first), false) => format!("{}. But: {first}", differences.join("; ")),
            (None, true) => "There is nothing to compare: no parameter is told by two of them.".to_owned(),
            (None, false) => format!("{}.", differences.join("; ")),
        };
        let sure = self.warnings.is_empty() && !differences.is_empty();
        Verdict { grade: if sure { Grade::Good } else { Grade::Doubtful }, sentence }
    }

    /// Whether a quantity differs, where it is compared.
    fn outcome(&self, compared: &Compared) -> Option<String> {
        let symbol = compared.quantity.symbol();
        let real = compared.differences.iter().filter(|difference| difference.is_real()).count();
        match compared.differences.as_slice() {
            [] => None,
            [only] => {
                let [first, second] = [only.first, only.second].map(|label| self.labels[label].as_str());
                let size = with_error(only.value, only.std_error);
                Some(if only.is_real() {
                    format!("{symbol} differs: {second} − {first} = {size}")
                } else {
                    format!("no difference in {symbol} is seen ({second} − {first} = {size})")
                })
            }
            pairs if real == 0 => {
                Some(format!("no difference in {symbol} is seen in any of {} pairs", pairs.len()))
            }
            pairs => Some(format!("{symbol} differs in {real} of {} pairs", pairs.len())),
        }
    }
}
