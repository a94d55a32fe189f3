//! The rounds of the search, in order: what each proposes, when it is worth it, and whether the noise is learnt from what it found.

use rayon::prelude::*;

use super::super::effect::{Cost, Effect};
use super::super::hypothesis::Hypothesis;
use super::super::laws;
use super::super::misfit::{Misfit, leaves_more_than_noise, needs};
use super::super::refit::{Refit, best, best_of_each_count, least, least_chi2};
use super::super::screen::{Score, Screen};
use super::super::stretches::asked_for;
use super::Search;
use super::frequency_match::FrequencyMatched;
use super::one_more::Beside;
use super::proposal::{DAMPER_IMITATION, Proposal, comes_to_rest};

/// A fall of χ² by this much is worth a pair: of its first effect below the base model, and promised for the second (statistics: 2 σ of one number).
const WORTH_A_PAIR: f64 = 4.0;
/// A pair is still promising where it promises this much more than the multiple of the least χ² that is stated for it (cost).
const PAIR_MARGIN: f64 = 100.0;

/// One round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Round {
    /// Sets of laws that short stretches of the recordings ask for, where the base model leaves far more than noise.
    Asked,
    /// Every effect alone, beside the base model.
    Singles,
    /// Those that are dear to fit: sought the longer the less the others explain.
    ExpensiveSingles,
    /// The same of a strip, whose fits are dearer still, after its pairs: what has corners in every joint takes a step as dear as ten of another effect's.
    StripExpensiveSingles,
    /// After a search of the first part of recordings, the single effects that it does not tell from its best: the whole of them may.
    Indistinguishable,
    /// The others from where one effect stands that explains most of what the base model leaves, with another spring or damper.
    FromBest,
    /// Pairs that promise most, each from the better of its two singles.
    Pairs,
    /// Simpler hypotheses from a fit with more effects that has found a lower minimum.
    FromRicherFits,
    /// Single effects, and none, along the motion of the best fit, where they leave more.
    AlongBest,
    /// Other effects in the place of one of the likeliest fit, where the tangents say that they would do as well.
    Twins,
    /// Hypotheses that leave more than one with fewer of their effects, which proves a failed fit: from that one.
    Nested,
    /// The likeliest hypotheses from further starts, until enough of them agree.
    Certify,
    /// The best single effects anew from the first part of the recordings.
    RestartedSingles,
    /// Every effect beside the best single ones, from all its starts.
    BesideSingles,
    /// The best fits anew from the first part of the recordings.
    RestartedBest,
    /// The best fits from the beginning of the recordings on.
    FromTheBeginning,
    /// One effect more beside the best of each number of coefficients.
    OneMore,
    /// One effect fewer, and another in its place.
    OneFewer,
}

/// When the noise is learnt anew after a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseUpdate {
    /// Not.
    Never,
    /// Where the best fit leaves less than before.
    IfLower,
    /// Always.
    Always,
}

impl Round {
    /// The rounds that every recording has.
    pub const USUAL: [Self; 8] = [
        Self::Asked,
        Self::Singles,
        Self::ExpensiveSingles,
        Self::FromBest,
        Self::AlongBest,
        Self::Pairs,
        Self::FromRicherFits,
        Self::StripExpensiveSingles,
    ];
    /// Those where the best of the usual ones leaves more than noise: it may stand in a false minimum, or its partner have been sought from the wrong place.
    pub const RESTARTS: [Self; 3] = [Self::RestartedSingles, Self::BesideSingles, Self::RestartedBest];

    /// The name, of which progress tells.
    pub fn name(self) -> &'static str {
        match self {
            Self::Asked => "sets from short stretches",
            Self::Singles => "single effects",
            Self::ExpensiveSingles => "slow single effects",
            Self::StripExpensiveSingles => "slow single effects of a strip",
            Self::Indistinguishable => "undecided single effects",
            Self::FromBest => "second effects beside the best",
            Self::Pairs => "pairs of effects",
            Self::FromRicherFits => "restarts from better fits",
            Self::AlongBest => "restarts along the best fit",
            Self::Twins => "effects that do as well",
            Self::Nested => "restarts from smaller sets",
            Self::Certify => "further starts",
            Self::RestartedSingles => "restarts of the best single effects",
            Self::RestartedBest => "restarts of the best fits",
            Self::BesideSingles => "second effects from further starts",
            Self::FromTheBeginning => "extension from the beginning",
            Self::OneMore => "one effect more",
            Self::OneFewer => "one effect less",
        }
    }

    /// When the noise is learnt anew.
    pub fn learns(self) -> NoiseUpdate {
        match self {
            Self::AlongBest | Self::Pairs | Self::RestartedBest | Self::OneFewer => NoiseUpdate::Always,
            Self::FromRicherFits => NoiseUpdate::IfLower,
            _ => NoiseUpdate::Never,
        }
    }

    /// What it proposes.
    pub fn proposals<'f, 'a>(self, search: &'f Search<'a, '_>, tried: &mut Tried) -> Vec<Proposal<'f, 'a>> {
        match self {
            Self::Asked => search.asked(),
            Self::Singles => search.singles(),
            Self::ExpensiveSingles => search.expensive_singles(false),
            Self::StripExpensiveSingles => search.expensive_singles(true),
            Self::Indistinguishable => search.indistinguishable(),
            Self::FromBest => search.begun_at_the_leader(),
            Self::Pairs => search.pairs(),
            Self::FromRicherFits => search.started_from_richer_fits(),
            Self::AlongBest => search.along_the_leader(),
            Self::Twins => search.twins(),
            Self::Nested => search.nested(),
            Self::Certify => search.further_starts(),
            Self::RestartedSingles => search.leaders().into_iter().map(Proposal::Restart).collect(),
            Self::BesideSingles => search.beside_leaders(),
            Self::RestartedBest => search.restarted_best(),
            Self::FromTheBeginning => vec![Proposal::Continued(&search.fits, &search.effects)],
            Self::OneMore => search.one_more(tried),
            Self::OneFewer => search.one_fewer(tried),
        }
    }
}

/// Effects that have had their turn.
#[derive(Debug, Default)]
pub struct Tried {
    /// Those beside which another one was sought.
    pub more: Vec<Vec<Effect>>,
    /// Those of which one was left out.
    pub fewer: Vec<Vec<Effect>>,
}

impl<'a> Search<'a, '_> {
    /// A strip's marks do not show its rods.
    fn asked(&self) -> Vec<Proposal<'_, 'a>> {
        if !self.leaves_more_than_noise() || self.context.is_strip() {
            return Vec::new();
        }
        // the small swings at the end part the losses
        let whole = self.context.on(&self.prepared.records);
        let asked = asked_for(&whole, self.base(), &self.effects, self.context.settings.search.asked);
        asked.into_iter().map(|asked| Proposal::Asked(asked, self.base())).collect()
    }

    /// Every effect of ordinary cost beside the base model, and one that promises more than all of them.
    fn singles(&self) -> Vec<Proposal<'_, 'a>> {
        self.beside_base(self.lacking(), |effect| is_ordinary(effect) || self.promises_most(effect))
    }

    /// The others, where the base model is a strip, or where it is none.
    fn expensive_singles(&self, of_strip: bool) -> Vec<Proposal<'_, 'a>> {
        if self.context.is_strip() != of_strip {
            return Vec::new();
        }
        let misfit = self.lacking().beside(&self.fits[1..]);
        self.beside_base(misfit, |effect| !is_ordinary(effect) && !self.promises_most(effect))
    }

    /// Whether an effect of a strip that is dear to fit promises more than every other one: the budget would end before its turn, and the others only bend to it.
    fn promises_most(&self, effect: Effect) -> bool {
        let is_dear = !is_ordinary(effect) && !laws::has_corners_in_every_joint(&self.context, effect);
        let ordinary = self.effects.iter().filter(|effect| is_ordinary(**effect)).map(|effect| self.promised(*effect));
        self.context.is_strip() && is_dear && self.promised(effect) > ordinary.fold(0.0, f64::max)
    }

    /// Along the motion of the best fit of the whole; where that has no effect, beside it, those first that the whole promises. And those that are scanned, of which the
    /// part has only told roughly at which frequency, or at which instant, they act.
    fn indistinguishable(&self) -> Vec<Proposal<'_, 'a>> {
        let settings = self.context.settings;
        let Some(best) = least(&self.fits) else { return Vec::new() };
        let needs = |fit: &Refit<'a>| needs(fit, best, &settings.misfit);
        let leader = self.fits.iter().min_by(|a, b| needs(a).total_cmp(&needs(b))).unwrap_or(best);
        let is_fitted = |effect: &Effect| self.fits.iter().any(|fit| fit.hypothesis.effects == [*effect]);
        let scanned: Vec<Effect> =
            self.effects.iter().copied().filter(|effect| effect.is_scanned() && is_fitted(effect)).collect();
        let again = self.scanned_again(&scanned);
        let mut indistinguishable: Vec<Effect> =
            self.indistinguishable.iter().copied().filter(|effect| !is_fitted(effect)).collect();
        if !leader.hypothesis.effects.is_empty() {
            indistinguishable.truncate(settings.search.tried);
            let along =
                |effect| Proposal::Along(Hypothesis { effects: vec![effect], dropped: None }, leader, f64::INFINITY);
            return indistinguishable.into_iter().map(along).chain(again).collect();
        }
        indistinguishable.retain(|effect| self.promised(*effect) > settings.misfit.counts);
        indistinguishable.sort_by(|a, b| self.promised(*b).total_cmp(&self.promised(*a)));
        indistinguishable.truncate(settings.search.tried);
        let beside = self.beside_base(self.lacking(), |effect| indistinguishable.contains(&effect));
        beside.into_iter().chain(again).collect()
    }

    /// Some effects beside the base model from where a scan of the whole points.
    fn scanned_again(&self, effects: &[Effect]) -> Vec<Proposal<'_, 'a>> {
        let screen = (!effects.is_empty()).then(|| Screen::at(&self.context, self.base())).flatten();
        let scores = screen.map(|screen| laws::scores(&screen, effects)).unwrap_or_default();
        scores.into_iter().map(|score| Proposal::Scored(self.base(), score)).collect()
    }

    /// Effects of some kind beside the base model, those first that promise most: the budget may end before the others.
    fn beside_base(&self, misfit: Misfit, is_of_kind: impl Fn(Effect) -> bool) -> Vec<Proposal<'_, 'a>> {
        if let Some(FrequencyMatched { base, scores }) = &self.frequency_matched {
            let mut of_kind: Vec<&Score> = scores.iter().filter(|score| is_of_kind(score.effect)).collect();
            of_kind.sort_by(|a, b| b.gain.total_cmp(&a.gain));
            return of_kind.into_iter().map(|score| Proposal::Scored(base, score.clone())).collect();
        }
        let mut of_kind: Vec<Effect> = self.effects.iter().copied().filter(|effect| is_of_kind(*effect)).collect();
        of_kind.sort_by(|a, b| self.promised(*b).total_cmp(&self.promised(*a)));
        // a strip's fits are dear: what promises little beside a base model that leaves more than noise is not followed by itself
        let is_followed = !self.context.is_strip() || !misfit.unexplained;
        let most = self.scores.iter().map(|score| score.gain).fold(0.0, f64::max);
        let beside = |effect| match self.scores.iter().find(|score| score.effect == effect) {
            Some(score) if !is_followed && score.gain < self.context.settings.search.most_of * most => {
                Proposal::Begun(self.base(), score.clone())
            }
            _ => Proposal::Beside(Beside::of(self.base(), misfit, effect, &self.scores)),
        };
        of_kind.into_iter().map(beside).collect()
    }

    /// By how much an effect promises to lower the base model's χ².
    fn promised(&self, effect: Effect) -> f64 {
        let scores = self.frequency_matched.as_ref().map_or(&self.scores, |matched| &matched.scores);
        scores.iter().find(|score| score.effect == effect).map_or(0.0, |score| score.gain)
    }

    fn begun_at_the_leader(&self) -> Vec<Proposal<'_, 'a>> {
        let (settings, base) = (&self.context.settings.search, self.base());
        let Some(leader) = least(&self.fits).filter(|best| best.chi2 < settings.leader_leaves * base.chi2) else {
            return Vec::new();
        };
        let moved = |parameter: &_| {
            let (before, after) = (base.value(*parameter).unwrap_or(0.0), leader.value(*parameter).unwrap_or(0.0));
            (after - before).abs() > settings.elsewhere * before.abs()
        };
        if !self.context.base.iter().any(moved) {
            return Vec::new();
        }
        let others = self.fits.iter().filter(|fit| !fit.hypothesis.is_expensive() && !std::ptr::eq(*fit, leader));
        others.map(|fit| Proposal::FromLeader { fit, hypothesis: fit.hypothesis.clone(), leader }).collect()
    }

    /// Where the base model leaves more than noise: a rival in a false minimum would count as evidence for the best. A strip's fits are too dear for it.
    fn along_the_leader(&self) -> Vec<Proposal<'_, 'a>> {
        let is_asked = self.lacking().unexplained && !self.context.is_strip();
        let Some(leader) = least(&self.fits).filter(|_| is_asked) else { return Vec::new() };
        let behind = leader.chi2 + self.context.settings.misfit.counts;
        let is_behind = |fit: &&Refit<'a>| !fit.hypothesis.is_expensive() && fit.chi2 > behind;
        self.fits
            .iter()
            .filter(is_behind)
            .map(|fit| Proposal::Along(fit.hypothesis.clone(), leader, fit.chi2))
            .collect()
    }

    fn nested(&self) -> Vec<Proposal<'_, 'a>> {
        let of = |fit: &Refit<'a>| {
            let within = self.best_within(fit)?;
            let dropped = within.hypothesis.dropped.or(fit.hypothesis.dropped);
            Some(Proposal::Nested(fit.hypothesis.clone().dropping(dropped), within))
        };
        self.fits.iter().filter_map(of).collect()
    }

    /// The best fit of a hypothesis within another fit's own that leaves less than that one does.
    pub fn best_within(&self, fit: &Refit<'a>) -> Option<&Refit<'a>> {
        let variance = (least_chi2(&self.fits) / self.context.values() as f64).max(1.0);
        let bound = fit.chi2 - self.context.settings.certificate.agrees * variance;
        let within = self.fits.iter().filter(|own| own.chi2 < bound && own.hypothesis.nests_in(&fit.hypothesis));
        within.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
    }

    /// Of those fits that may count the ones that too few starts have led to: along the motion of the best other one, from short stretches, and from the
    /// beginning of the recordings on. A strip's fits are too dear for it.
    fn further_starts(&self) -> Vec<Proposal<'_, 'a>> {
        let (settings, base) = (&self.context.settings.certificate, self.base());
        let least = least(&self.fits).unwrap_or(base);
        let needs = |fit: &Refit<'a>| needs(fit, least, &self.context.settings.misfit);
        let order = best(&self.fits, usize::MAX, |_| !self.context.is_strip(), needs);
        let enough = order.first().map_or(0.0, |first| needs(&self.fits[*first])) + settings.within;
        let counts = order.iter().map(|place| &self.fits[*place]).filter(|fit| needs(fit) < enough).take(settings.most);
        let lacking = counts.filter(|fit| fit.certificate.starts_agreeing < settings.starts);
        let of = |fit: &Refit<'a>| {
            let hypothesis = &fit.hypothesis;
            let leader = order.iter().map(|place| &self.fits[*place]).find(|other| other.hypothesis != *hypothesis);
            let along = leader.map(|leader| Proposal::Along(hypothesis.clone(), leader, f64::INFINITY));
            let anew = Proposal::ByShooting(hypothesis.clone(), base);
            let begun = Proposal::FromTheBeginning(hypothesis.clone(), base);
            along.into_iter().chain([anew, begun]).collect::<Vec<_>>()
        };
        lacking.flat_map(of).collect()
    }

    fn pairs(&self) -> Vec<Proposal<'_, 'a>> {
        let (settings, counts) = (&self.context.settings.search, self.context.settings.misfit.counts);
        let base = self.base();
        let further = laws::cheap_to_score(&self.context, &self.effects);
        let is_single = |s: &&Refit<'a>| s.hypothesis.effects.len() == 1;
        let mut seeds: Vec<&Refit<'a>> =
            self.fits[1..].iter().filter(is_single).filter(|s| s.chi2 < base.chi2 - WORTH_A_PAIR).collect();
        seeds.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        seeds.truncate(settings.pair_seeds);
        let least = seeds.first().map_or(0.0, |s| s.chi2);
        seeds.retain(|s| s.chi2 < settings.far * least);
        let scored = |(rank, seed): (usize, &&'_ Refit<'a>)| {
            let few = further.iter().copied().filter(|e| rank < settings.expensive_seeds || !e.is_expensive_to_score());
            Some(laws::scores(&Screen::at(&self.context, seed)?, &few.collect::<Vec<_>>()))
        };
        let scored: Vec<Option<Vec<Score>>> = seeds.par_iter().with_max_len(1).enumerate().map(scored).collect();
        let mut pairs: Vec<(f64, &Refit<'a>, Hypothesis, Score)> = Vec::new();
        for (seed, score) in seeds.into_iter().zip(scored).flat_map(|(seed, all)| {
            all.unwrap_or_default().into_iter().filter(|s| s.gain > WORTH_A_PAIR).map(move |score| (seed, score))
        }) {
            // a promise from afar is worth little
            let promised = (seed.chi2 - score.gain).max(settings.afar * seed.chi2);
            let hypothesis = score.hypothesis(&seed.hypothesis);
            match pairs.iter_mut().find(|p| p.2.effects == hypothesis.effects) {
                Some(known) if promised < known.0 => *known = (promised, seed, hypothesis, score),
                Some(_) => {}
                None => pairs.push((promised, seed, hypothesis, score)),
            }
        }
        // what has corners is dear: only where it promises what a further effect must gain
        let alone = least_chi2(&self.fits);
        pairs.retain(|(promised, _, hypothesis, _)| !hypothesis.has_switching() || *promised < alone - counts);
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs.truncate(settings.most_pairs);
        let least = pairs.first().map_or(0.0, |p| p.0);
        let is_kept = |(rank, pair): &(usize, (f64, _, _, _))| {
            *rank < settings.fewest_pairs || pair.0 < settings.promising * least + PAIR_MARGIN
        };
        let kept = pairs.into_iter().enumerate().filter(is_kept);
        let scored = kept.map(|(_, (_, seed, _, score))| Proposal::Scored(seed, score));
        let replace_dampers = DAMPER_IMITATION
            .iter()
            .all(|effect| self.effects.contains(effect))
            .then_some(Proposal::ReplaceDampers(base));
        scored.chain(replace_dampers).collect()
    }

    /// Where a pair has found a better minimum of a simpler hypothesis, one of its effects being next to nothing, that hypothesis starts anew from it.
    fn started_from_richer_fits(&self) -> Vec<Proposal<'_, 'a>> {
        let counts = self.context.settings.misfit.counts;
        let of = |fit: &'_ Refit<'a>| {
            let richer = |other: &&Refit<'a>| {
                let (few, many) = (&fit.hypothesis, &other.hypothesis);
                many.effects.len() > few.effects.len() && few.is_within(many) && other.chi2 < fit.chi2 - counts
            };
            let leader = self.fits.iter().filter(richer).min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
            Some((fit.hypothesis.clone().dropping(leader.hypothesis.dropped), leader))
        };
        let proposed = self.fits.iter().filter_map(|fit| of(fit).map(|(hypothesis, leader)| (fit, hypothesis, leader)));
        proposed.map(|(fit, hypothesis, leader)| Proposal::FromLeader { fit, hypothesis, leader }).collect()
    }

    /// The single effects that leave least; where that is far more than noise, its colour does not count.
    fn leaders(&self) -> Vec<&Refit<'a>> {
        let settings = self.context.settings;
        let beyond = settings.noise.beyond * settings.noise.beyond * self.context.values() as f64;
        let beyond_noise = least_chi2(&self.fits) > beyond;
        let left = |fit: &Refit<'_>| if beyond_noise { fit.relative_residual() } else { fit.chi2 };
        let count = settings.search.restart_seeds;
        let chosen = best(&self.fits, count, |fit| fit.hypothesis.effects.len() == 1, left);
        chosen.into_iter().map(|i| &self.fits[i]).collect()
    }

    fn beside_leaders(&self) -> Vec<Proposal<'_, 'a>> {
        let leaders = self.leaders();
        let beside = leaders.iter().flat_map(|leader| Beside::every(&self.context, leader, &self.effects));
        let mut proposals: Vec<Proposal<'_, 'a>> = beside.map(Proposal::Beside).collect();
        // corners make false minima
        for effect in self.effects.iter().filter(|effect| effect.has_switching()) {
            let lacking = leaders.iter().filter(|leader| !leader.hypothesis.has(*effect));
            let bases = lacking.copied().chain(self.fits.first());
            proposals.extend(bases.map(|base| Proposal::ManyStarts(base, *effect)));
        }
        proposals
    }

    fn restarted_best(&self) -> Vec<Proposal<'_, 'a>> {
        let mut chosen = best(&self.fits, self.context.settings.search.restarted, |_| true, |fit| fit.chi2);
        if self.context.records.iter().any(|record| comes_to_rest(&self.context, record)) {
            let can_stop = |fit: &Refit<'a>| fit.hypothesis.effects.iter().any(|effect| effect.entry().can_stop);
            chosen.extend((0..self.fits.len()).filter(|i| can_stop(&self.fits[*i])));
        }
        chosen.sort_unstable();
        chosen.dedup();
        chosen.into_iter().map(|i| Proposal::Restart(&self.fits[i])).collect()
    }

    fn one_more(&self, tried: &mut Tried) -> Vec<Proposal<'_, 'a>> {
        let settings = &self.context.settings.search;
        let best_of_all = least(&self.fits).map_or(0.0, Refit::relative_residual);
        let mut leading = best_of_each_count(&self.fits, settings.most_coefficients);
        leading.retain(|fit| fit.relative_residual() <= settings.leads * best_of_all);
        let seeds = not_yet(leading, &mut tried.more);
        let more = seeds.into_iter().flat_map(|seed| Beside::most_promising(&self.context, seed, &self.effects));
        more.map(Proposal::Beside).collect()
    }

    /// Of the likeliest fit every effect that would do as well in the place of one of it: it was sought from where fewer effects stand. After a search of a part of the
    /// recordings so of the best fits with fewer coefficients, too, for it has not fitted every effect to the whole. Where far more than noise is left a promise says
    /// little.
    fn twins<'f>(&'f self) -> Vec<Proposal<'f, 'a>> {
        let settings = self.context.settings;
        let Some(least) = least(&self.fits) else { return Vec::new() };
        let needs = |fit: &Refit<'a>| needs(fit, least, &settings.misfit);
        let likeliest = best(&self.fits, 1, |_| true, needs);
        let Some(likeliest) = likeliest.first().map(|place| &self.fits[*place]) else { return Vec::new() };
        if leaves_more_than_noise(likeliest, &settings.noise) {
            return Vec::new();
        }
        let fewer = if self.part < 1.0 { likeliest.coefficients().saturating_sub(1) } else { 0 };
        let mut held = best_of_each_count(&self.fits, fewer);
        held.retain(|fit| needs(fit) < needs(likeliest) + settings.certificate.within);
        held.push(likeliest);
        let of = |fit: &'f Refit<'a>| {
            let effects = fit.hypothesis.effects.iter();
            effects.map(move |effect| Proposal::Twins(fit, *effect, self.never_instead(fit, *effect)))
        };
        held.into_iter().flat_map(of).collect()
    }

    /// Effects that have never been fitted in the place of one of a fit.
    fn never_instead(&self, fit: &Refit<'a>, effect: Effect) -> Vec<Effect> {
        let is_fitted =
            |hypothesis: Hypothesis| self.fits.iter().any(|own| own.hypothesis.effects == hypothesis.effects);
        let fewer = fit.hypothesis.without(effect);
        let others = self.effects.iter().copied().filter(|other| !fit.hypothesis.has(*other));
        others.filter(|other| !is_fitted(fewer.and(*other, None))).collect()
    }

    /// Pairs have been sought from every side, and where far more than noise is left nothing does as well: only of three, and of what pieces of the recordings led
    /// to, is another put in the place of one.
    fn one_fewer(&self, tried: &mut Tried) -> Vec<Proposal<'_, 'a>> {
        let settings = self.context.settings;
        let seeds = not_yet(best_of_each_count(&self.fits, settings.search.most_coefficients), &mut tried.fewer);
        let rivals = |seed: &'_ Refit<'a>| -> &[Effect] {
            let many = seed.hypothesis.effects.len() > settings.search.main_effects;
            let near_noise = many && !leaves_more_than_noise(seed, &settings.noise);
            // corners are dear, and what stands beside them has been asked for
            let of_pieces = self.context.is_in_pieces() && !seed.hypothesis.has_switching();
            if near_noise || of_pieces { &self.effects } else { &[] }
        };
        let of = |seed| {
            let others = rivals(seed);
            seed.hypothesis.effects.iter().map(move |effect| Proposal::Exchange(seed, *effect, others))
        };
        seeds.into_iter().flat_map(of).collect()
    }
}

fn is_ordinary(effect: Effect) -> bool {
    effect.entry().cost == Cost::Ordinary
}

/// The fits whose effects have not yet had their turn, which then have.
fn not_yet<'f, 'a>(fits: Vec<&'f Refit<'a>>, had: &mut Vec<Vec<Effect>>) -> Vec<&'f Refit<'a>> {
    let new: Vec<&Refit<'a>> = fits.into_iter().filter(|fit| !had.contains(&fit.hypothesis.effects)).collect();
    had.extend(new.iter().map(|fit| fit.hypothesis.effects.clone()));
    new
}
