//! The observed rate of convergence: a factor per iteration, fitted to the tail of a history.

/// Fewest entries from which a rate is told.
const FEWEST: usize = 4;

/// The asymptotic factor per iteration of a history of errors, entry 0 being the start.
///
/// Entries at or below `floor` (rounding level) and all after them are left out, then the first half, which is
/// pre-asymptotic; where the later half of the rest still converges at another pace than the earlier, it alone is
/// used. The factor is exp of the least-squares slope of log(error). `None` if fewer than four entries remain.
///
/// ```
/// use limitlab::analysis::rate::observed_rate;
///
/// let history: Vec<f64> = (0..40).map(|k| 5.0 * 0.2f64.powi(k) + 0.8f64.powi(k)).collect();
/// let rate = observed_rate(&history, 0.0).expect("forty entries");
/// assert!((rate - 0.8).abs() < 1e-4);
/// ```
pub fn observed_rate(history: &[f64], floor: f64) -> Option<f64> {
    let end = history.iter().position(|&e| !(e > floor && e.is_finite())).unwrap_or(history.len());
    let usable = &history[..end];
    if usable.len() < FEWEST {
        return None;
    }
    let mut tail = &usable[(usable.len() / 2).min(usable.len() - FEWEST)..];
    // Each round halves the tail, so the work stays linear.
    while tail.len() >= 4 * FEWEST {
        let (early, late) = tail.split_at(tail.len() / 2);
        if (slope(early) - slope(late)).abs() <= SAME_PACE * slope(late).abs() {
            break;
        }
        tail = late;
    }
    Some(slope(tail).exp())
}

/// Slopes that differ relatively by no more count as one. Tuned on histories of two modes: a smaller value only
/// shortens the tail.
const SAME_PACE: f64 = 0.01;

/// The least-squares slope of log(errors) over their index.
fn slope(errors: &[f64]) -> f64 {
    let n = errors.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let (mut above, mut below) = (0.0, 0.0);
    for (k, e) in errors.iter().enumerate() {
        let t = k as f64 - middle;
        above += t * e.ln();
        below += t * t;
    }
    above / below
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slow_mode_counts_not_the_loud_one() {
        let history: Vec<f64> = (0..120).map(|k| 1e6 * 0.5f64.powi(k) + 0.95f64.powi(k)).collect();
        let rate = observed_rate(&history, 0.0).expect("long enough");
        assert!((rate - 0.95).abs() < 1e-3, "{rate}");
    }

    #[test]
    fn rounding_level_does_not_count() {
        let history: Vec<f64> =
            (0..200).map(|k| 0.7f64.powi(k).max(1e-15) * if k % 2 == 0 { 1.0 } else { 1.1 }).collect();
        let rate = observed_rate(&history, 1e-14).expect("long enough");
        assert!((rate - 0.7).abs() < 1e-2, "{rate}");
    }

    #[test]
    fn growth_is_a_rate_above_one() {
        let history: Vec<f64> = (0..60).map(|k| 0.3f64.powi(k) + 1e-3 * 1.25f64.powi(k)).collect();
        let rate = observed_rate(&history, 0.0).expect("long enough");
        assert!((rate - 1.25).abs() < 1e-6, "{rate}");
    }

    /// Errors that fall by a constant factor in each of successive stretches.
    fn stretches(lengths_and_rates: &[(usize, f64)]) -> Vec<f64> {
        let rates = lengths_and_rates.iter().flat_map(|&(length, rate)| std::iter::repeat_n(rate, length));
        rates.scan(1.0, |error, rate| Some(std::mem::replace(error, *error * rate))).collect()
    }

    /// The factor of the least-squares line through (k, log e_k), by the normal equations.
    fn fitted(errors: &[f64]) -> f64 {
        let n = errors.len() as f64;
        let sum = |term: &dyn Fn(f64, f64) -> f64| -> f64 {
            errors.iter().enumerate().map(|(k, e)| term(k as f64, e.ln())).sum()
        };
        let (k, l) = (sum(&|k, _| k), sum(&|_, l| l));
        let (kk, kl) = (sum(&|k, _| k * k), sum(&|k, l| k * l));
        ((n * kl - k * l) / (n * kk - k * k)).exp()
    }

    fn assert_rate(history: &[f64], expected: f64) {
        let rate = observed_rate(history, 0.0).expect("long enough");
        assert!((rate - expected).abs() < 1e-12, "{rate} instead of {expected} of {} entries", history.len());
    }

    #[test]
    fn the_first_half_is_left_out_and_all_of_the_second_is_used() {
        for n in 8..31 {
            assert_rate(&stretches(&[(n / 2, 0.3), (n - n / 2, 0.9)]), 0.9);
            // One entry more of the other pace would be seen, and so would one less of this.
            let late = stretches(&[(n / 2 + 1, 0.3), (n - n / 2 - 1, 0.9)]);
            assert_rate(&late, fitted(&late[n / 2..]));
        }
        // Four entries are fitted, if no more are left.
        assert_rate(&stretches(&[(2, 0.3), (4, 0.9)]), 0.9);
    }

    #[test]
    fn sixteen_entries_are_halved_where_the_pace_changes_by_more_than_a_hundredth() {
        let fifteen = stretches(&[(15, 0.3), (7, 0.9), (8, 0.8)]);
        assert_rate(&fifteen, fitted(&fifteen[15..]));
        assert_rate(&stretches(&[(16, 0.3), (8, 0.9), (8, 0.8)]), 0.8);
        let faster = |part: f64| 0.9f64.powf(1.0 + part);
        assert_rate(&stretches(&[(32, 0.3), (16, 0.9), (16, faster(0.03))]), faster(0.03));
        let steady = stretches(&[(32, 0.3), (16, 0.9), (16, faster(0.005))]);
        assert_rate(&steady, fitted(&steady[32..]));
    }

    #[test]
    fn too_short_a_history_has_no_rate() {
        assert_eq!(observed_rate(&[1.0, 0.5, 0.25], 0.0), None);
        assert_eq!(observed_rate(&[1.0, 0.5, 0.25, 0.0, 0.0, 0.0], 0.0), None);
        assert_eq!(observed_rate(&[], 0.0), None);
    }
}
