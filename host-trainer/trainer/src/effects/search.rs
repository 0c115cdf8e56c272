//! Which sets of effects are tried, and which one is kept.

use super::{Effect, PilotFigures, Price, choose};

/// So many times the difference of two seeds is taken for chance.
///
/// Of three numbers of one normal distribution the third is above the mean of the first two by more than twice their difference about
/// once in eight times: (c − (a + b)/2) / |a − b| is √(3/4) times a Cauchy variable.
const CHANCE: f64 = 2.0;

/// What pilots came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilots {
    /// What may be chance: twice the difference of the two pilots without effects, which differ in their seeds, dB.
    pub chance_db: f64,
    /// Each pilot; the first is the mean of those two.
    pub each: Vec<Pilot>,
}

/// A pilot and what came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilot {
    /// The effects that it had.
    pub effects: Vec<Effect>,
    /// What it was worth.
    pub worth: PilotFigures,
    /// What it gained over the pilot without effects, dB.
    pub gain_db: f64,
    /// What it had to gain, dB.
    pub price_db: f64,
    /// Whether it is the one to keep.
    pub chosen: bool,
}

impl Pilot {
    /// What is left of its gain, dB.
    fn left_db(&self) -> f64 {
        self.gain_db - self.price_db
    }
}

/// Tries no effect, from two seeds; each of [`Effect::MEASURED`]; and all that gained what an effect has to gain where these are several,
/// for they may share what they cost. Of those it leaves out one after the other, the one first that had least left by itself, as long
/// as that leaves more.
///
/// * `worth_of`: of a set of effects, and a number to change the seed by.
///
/// # Errors
/// Those of `worth_of`.
pub(super) fn search<E>(
    price: &Price,
    mut worth_of: impl FnMut(&[Effect], u64) -> Result<PilotFigures, E>,
) -> Result<Pilots, E> {
    let (one, other) = (worth_of(&[], 0)?, worth_of(&[], 1)?);
    let (without, chance_db) = (one.mean_with(&other), CHANCE * (one.psnr_db - other.psnr_db).abs());
    let mut trial_of = |effects: &[Effect]| -> Result<Pilot, E> {
        let worth = worth_of(effects, 0)?;
        let gain_db = worth.psnr_db - without.psnr_db;
        let price_db = price.of(effects.len(), &worth, &without, chance_db);
        Ok(Pilot { effects: effects.to_vec(), worth, gain_db, price_db, chosen: false })
    };
    let nothing = Pilot { effects: Vec::new(), worth: without, gain_db: 0.0, price_db: 0.0, chosen: false };
    let mut each = vec![nothing];
    for effect in Effect::MEASURED {
        each.push(trial_of(&[effect])?);
    }
    let mut gainers: Vec<(f64, Effect)> = each
        .iter()
        .filter(|trial| trial.gain_db > price.effect_db.max(chance_db))
        .flat_map(|trial| trial.effects.iter().map(|effect| (trial.left_db(), *effect)))
        .collect();
    let mut most_left_db = f64::NEG_INFINITY;
    while gainers.len() > 1 {
        let together: Vec<Effect> = gainers.iter().map(|(_, effect)| *effect).collect();
        let trial = trial_of(&together)?;
        let left_db = trial.left_db();
        each.push(trial);
        if left_db <= most_left_db {
            break;
        }
        most_left_db = left_db;
        let least = (0..gainers.len()).min_by(|a, b| gainers[*a].0.total_cmp(&gainers[*b].0));
        least.map(|least| gainers.remove(least));
    }
    let numbers: Vec<(usize, PilotFigures)> = each.iter().map(|trial| (trial.effects.len(), trial.worth)).collect();
    let chosen = choose(price, &numbers, chance_db);
    each[chosen].chosen = true;
    Ok(Pilots { chance_db, each })
}

#[cfg(test)]
mod tests {
    use Effect::{Anisotropy, Detail, ViewColour, ViewGeometry};

    use super::*;

    /// The sets that are tried, in order, and the one that is kept, where a set gains `gain_db` and makes a frame as dear as `frame`.
    fn tried(gain_db: impl Fn(&[Effect]) -> f64, frame: impl Fn(&[Effect]) -> f64) -> (Vec<Vec<Effect>>, Vec<Effect>) {
        let mut tried = Vec::new();
        let trials = search(&Price::for_device(), |effects, seed| {
            tried.push(effects.to_vec());
            let psnr_db = 30.0 + gain_db(effects) + 0.001 * seed as f64;
            Ok::<_, ()>(PilotFigures { psnr_db, instructions: 1e6 * frame(effects), bytes: 1000 })
        });
        let chosen = trials.expect("no error").each.into_iter().filter(|trial| trial.chosen).map(|trial| trial.effects);
        (tried.split_off(2 + Effect::MEASURED.len()), chosen.flatten().collect())
    }

    fn sees_view(effects: &[Effect]) -> bool {
        effects.iter().any(|effect| matches!(effect, ViewColour | ViewGeometry))
    }

    #[test]
    fn what_shares_its_price_is_tried_together() {
        // Each view effect by itself is dearer than what it gains, both are not.
        let gain_db = |effects: &[Effect]| 0.7 * effects.iter().filter(|e| sees_view(&[**e])).count() as f64;
        let frame = |effects: &[Effect]| if sees_view(effects) { 3.0 } else { 1.0 };
        let both = vec![ViewColour, ViewGeometry];
        assert_eq!(tried(gain_db, frame), (vec![both.clone()], both));
    }

    #[test]
    fn what_does_not_pay_among_others_is_left_out_again() {
        // Whatever shows the colours' dependence on the view shows it once.
        let gain_db = |effects: &[Effect]| {
            f64::from(u8::from(effects.contains(&ViewColour) || effects.contains(&ViewGeometry)))
                + if effects.contains(&ViewGeometry) { 2.0 } else { 0.0 }
                + if effects.contains(&Anisotropy) { 1.5 } else { 0.0 }
                - if effects.contains(&Detail) { 0.1 } else { 0.0 }
        };
        let frame = |effects: &[Effect]| if sees_view(effects) { 2.0 } else { 1.0 };
        let (sets, chosen) = tried(gain_db, frame);
        let best = vec![ViewGeometry, Anisotropy];
        assert_eq!(sets, [vec![ViewColour, ViewGeometry, Anisotropy], best.clone()]);
        assert_eq!(chosen, best);
    }

    #[test]
    fn one_that_gains_alone_is_tried_with_nothing() {
        let gain_db = |effects: &[Effect]| if effects == [Anisotropy] { 1.0 } else { 0.0 };
        assert_eq!(tried(gain_db, |_| 1.0), (vec![], vec![Anisotropy]));
        assert_eq!(tried(|_| 0.0, |_| 1.0), (vec![], vec![]));
    }
}
