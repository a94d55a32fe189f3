//! What is assumed: the base model with some effects.

use super::effect::Effect;

/// The base model with some effects.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hypothesis {
    /// The effects added, in the order of the table.
    pub effects: Vec<Effect>,
    /// From which stamp on frames are missing, and in which recording.
    pub dropped: Option<(usize, f64)>,
}

impl Hypothesis {
    /// Whether it holds an effect.
    pub fn has(&self, effect: Effect) -> bool {
        self.effects.contains(&effect)
    }

    /// Whether its motion costs many times what others do.
    pub fn is_expensive(&self) -> bool {
        self.effects.iter().any(|effect| effect.is_expensive())
    }

    /// Whether every corner of a law of it ends a step.
    pub fn has_switching(&self) -> bool {
        self.effects.iter().any(|effect| effect.has_switching())
    }

    /// Whether another one has all of its effects.
    pub fn is_within(&self, other: &Self) -> bool {
        self.effects.iter().all(|effect| other.has(*effect))
    }

    /// Whether another one has all of its effects, and more, about the same chain: it can leave no less than that one does.
    pub fn nests_in(&self, other: &Self) -> bool {
        let chain = |of: &Self| of.effects.iter().copied().filter(|e| e.changes_chain()).collect::<Vec<_>>();
        self.effects.len() < other.effects.len() && self.is_within(other) && chain(self) == chain(other)
    }

    /// With one effect more.
    #[must_use]
    pub fn and(&self, effect: Effect, dropped: Option<(usize, f64)>) -> Self {
        let mut effects = self.effects.clone();
        effects.push(effect);
        effects.sort_unstable();
        Self { effects, dropped: if effect == Effect::DroppedFrames { dropped } else { self.dropped } }
    }

    /// With frames missing from there on, if it says that frames are missing.
    #[must_use]
    pub fn dropping(self, dropped: Option<(usize, f64)>) -> Self {
        Self { dropped: dropped.filter(|_| self.has(Effect::DroppedFrames)), ..self }
    }

    /// Without one of its effects.
    #[must_use]
    pub fn without(&self, effect: Effect) -> Self {
        let effects = self.effects.iter().copied().filter(|other| *other != effect).collect();
        Self { effects, dropped: None }.dropping(self.dropped)
    }
}

/// How many effects of a hypothesis have been held against every other effect.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Compared {
    /// Of any hypothesis, those that explain most.
    pub of_any: usize,
    /// Hypotheses of which every effect has been.
    pub whole: Vec<Vec<Effect>>,
}

impl Compared {
    /// Of some effects, those that explain most.
    pub fn of(&self, effects: &[Effect]) -> usize {
        if self.whole.iter().any(|whole| whole == effects) { effects.len() } else { self.of_any }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_beyond_two_are_compared_where_each_was_exchanged() {
        let three = [Effect::HingeCoulomb, Effect::AirQuadratic, Effect::CameraTilt];
        let compared = Compared { of_any: 2, whole: vec![three.to_vec()] };
        assert_eq!([compared.of(&three), compared.of(&three[..2])], [3, 2]);
        let other = [Effect::HingeCoulomb, Effect::AirQuadratic, Effect::CameraOblique];
        assert_eq!(compared.of(&other), 2);
    }

    #[test]
    fn an_instant_goes_with_the_frames_that_are_missing() {
        let at = Some((0, 10.7));
        let dropped = Hypothesis::default().and(Effect::DroppedFrames, at).and(Effect::HingeViscous, None);
        assert_eq!(dropped.dropped, at);
        assert_eq!(dropped.without(Effect::HingeViscous).dropped, at);
        let friction = Hypothesis::default().and(Effect::HingeViscous, None);
        assert_eq!(dropped.without(Effect::DroppedFrames), friction);
        assert_eq!(friction.clone().dropping(at), friction);
    }

    #[test]
    fn a_hypothesis_nests_in_a_richer_one_about_the_same_chain_only() {
        let of = |effects: &[Effect]| Hypothesis { effects: effects.to_vec(), dropped: None };
        let (rub, drag) = (of(&[Effect::HingeCoulomb]), of(&[Effect::AirQuadratic]));
        let both = rub.and(Effect::AirQuadratic, None);
        assert!(Hypothesis::default().nests_in(&rub) && rub.nests_in(&both) && drag.nests_in(&both));
        assert!(!both.nests_in(&rub) && !rub.nests_in(&rub) && !rub.nests_in(&drag));
        // a strip that bends everywhere is another chain: two rods are no special case of it
        let bent = of(&[Effect::HingeCoulomb, Effect::DistributedFlexibility]);
        assert!(!rub.nests_in(&bent) && of(&[Effect::DistributedFlexibility]).nests_in(&bent));
    }
}
