//! Every threshold of a diagnosis, with its source.
//!
//! Where a value comes from stands after it: *statistics*, it follows from a distribution; *training bank*, it was set on the training banks of the concealed
//! benchmark (`fixtures/concealed`), never on test banks; *cost*, it bounds the work, and is set where more work changed no answer there; *physics*, it
//! follows from how such things move; *judgement*, an experimenter's convention. Grids of start values and steps of numerical methods are no thresholds: they
//! stand where they are used, as *start values* and *numerics*.

/// All of them.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// What is noise.
    pub noise: NoiseSettings,
    /// Descents.
    pub descent: DescentSettings,
    /// Which fits lack something.
    pub misfit: MisfitSettings,
    /// What is fitted.
    pub search: SearchSettings,
    /// Which fits count.
    pub certificate: CertificateSettings,
    /// How probable each hypothesis is.
    pub prior: PriorSettings,
    /// Which answer that makes.
    pub verdict: VerdictSettings,
    /// What law is learnt beside it.
    pub law: LawSettings,
}

/// What is noise.
#[derive(Debug, Clone)]
pub struct NoiseSettings {
    /// A frequency belongs to the motion where that has more than this part of its largest power (training bank)…
    pub motion: f64,
    /// … and as much of it as the residual may hold would be more than this part of the noise (judgement: a tenth of a variance).
    pub leaks: f64,
    /// A line of the residual's own has this many times the power around it (statistics: by chance in e⁻²⁵ of the frequencies).
    pub line: f64,
    /// Part of the frequencies that has to be left (judgement).
    pub enough: f64,
    /// The frequencies off the lines tell only a part of noise that goes on: its variance is at most this multiple of the residual's (training bank).
    pub most: f64,
    /// ln-likelihood that colour must gain (statistics: two numbers more, e⁻⁶ by chance)…
    pub coloured: f64,
    /// … and white noise beside it (statistics: one number more).
    pub beside: f64,
    /// Two angles' noise goes together where their correlation is this many times what chance makes of it (statistics: 4 σ).
    pub together: f64,
    /// From this multiple of the noise on, noise is no yardstick for a model any more (training bank).
    pub beyond: f64,
    /// Noise that is learnt again from a fit with effects is at most this many times as large: a fit that has lost step leaves something at every frequency
    /// (training bank).
    pub grows: f64,
    /// A change of the noise by less than this part is none (judgement: less than its own uncertainty over 1000 values).
    pub changes: f64,
    /// Correlation of neighbouring residuals of short stretches that counts as colour (training bank).
    pub stretches_coloured: f64,
}

/// Descents.
#[derive(Debug, Clone)]
pub struct DescentSettings {
    /// Steps of a dear start before it is known to be worth any (cost).
    pub first_steps: usize,
    /// Of a first descent (cost).
    pub few_steps: usize,
    /// Of one that is worth it (cost).
    pub most_steps: usize,
    /// It has converged when the next step promises less than this part of the mean square (statistics: 0.02 of a χ² is 0.01 of an ln-likelihood).
    pub enough: f64,
    /// A fit from short stretches, or of a strip, goes on where its first steps lead below this multiple of the base model's χ² (training bank).
    pub hopeless_ratio: f64,
    /// A strip goes on where its first steps lead below this multiple of the base model's χ² (training bank).
    pub strip_continue_ratio: f64,
}

/// Which fits lack something.
#[derive(Debug, Clone)]
pub struct MisfitSettings {
    /// A fit that leaves this part of the swing lacks something, whatever the noise (judgement).
    pub much: f64,
    /// A motion that leaves more than this part of the swing has lost step (judgement: a phase lag of 0.35 rad).
    pub out_of_step: f64,
    /// χ² beyond its expectation by this many standard deviations is worth a dear hypothesis (statistics: 4 σ).
    pub deviations: f64,
    /// Where less than this many times the noise is left, in χ², many laws do as well as each other (training bank).
    pub little: f64,
    /// The part of what a fit leaves beyond the noise that the first steps from a dear start must explain (cost).
    pub leads: f64,
    /// A fall of χ² by this much counts (statistics: 3 σ of one number).
    pub counts: f64,
    /// A spring that has become so many times as stiff as the file and the recordings' modes say, or as soft, stands for something else (judgement: a file
    /// may be wrong ten times over).
    pub strays: f64,
}

/// Up to which share of the budget each phase of a search may go (cost).
#[derive(Debug, Clone, Copy)]
pub struct BudgetShares {
    /// After this much of it the base model's descent is begun nowhere else (cost).
    pub prepared: f64,
    /// Single effects and pairs (cost).
    pub usual: f64,
    /// Restarts (cost).
    pub restarts: f64,
    /// Further starts of the fits that count (cost).
    pub certified: f64,
    /// From the beginning on, more effects and fewer (cost). What is left is for further starts of what that found.
    pub further: f64,
    /// A law that no table holds is learnt beside all of that, with this much…
    pub law: f64,
    /// … while all together is not more than this (cost: no recording takes more than a minute on two cores)…
    pub all: f64,
    /// … and made simpler, turn by turn, with so much more (cost).
    pub simpler: f64,
    /// Of a strip, beside which no law is learnt, the budget of a search is so many times as large (cost).
    pub strip: f64,
}

/// What is fitted.
#[derive(Debug, Clone)]
pub struct SearchSettings {
    /// Work after which no further fit is begun (cost: a minute of two cores for everything; see [`crate::model::Work`]). What is left undecided is told.
    pub budget: u64,
    /// How the phases of a search share it.
    pub shares: BudgetShares,
    /// Motions with derivatives that a search makes (cost): where the budget does not allow so many of whole recordings, it is begun on their first part…
    pub evaluations: f64,
    /// … of at least so many swings (judgement: losses change with amplitude)…
    pub early_swings: f64,
    /// … unless that is next to the whole (cost).
    pub part_worth: f64,
    /// Where every model leaves far more than noise, recordings are cut in pieces of so many swings (judgement: enough to tell
    /// losses and clocks, see `fewest_swings`, and few enough for a small error of the model not to add up to a swing).
    pub piece_swings: f64,
    /// An inertia of a general link is known to this share (judgement: from a drawing)…
    pub inertia_share: f64,
    /// … and its centre of mass to this one (judgement: balanced on an edge, to a few millimetres in a tenth of a metre).
    pub com_share: f64,
    /// The distance of its two pivots to this one (judgement: a millimetre in a fifth of a metre, with a ruler).
    pub length_share: f64,
    /// An encoder's zero is known to this angle (rad; judgement: a step or two of a tenth of a degree).
    pub encoder_zero_rad: f64,
    /// Sets of the largest number of laws that is worth its coefficients which are fitted because short stretches ask for them (cost).
    pub asked: usize,
    /// Fits from which pairs are built (cost).
    pub pair_seeds: usize,
    /// Of these, the ones beside which what is dear to score is looked for (cost).
    pub expensive_seeds: usize,
    /// Fits that leave this many times the best one's χ² are no seeds (cost).
    pub far: f64,
    /// No pair is promised less than this part of its seed's χ²: a promise from afar is worth little (training bank).
    pub afar: f64,
    /// Pairs fitted in full (cost).
    pub most_pairs: usize,
    /// Pairs fitted even where they promise little (training bank).
    pub fewest_pairs: usize,
    /// A pair that promises more than this many times the least χ² is not fitted (cost).
    pub promising: f64,
    /// An effect that leaves less than this part of the base model's χ² leads the others (training bank)…
    pub leader_leaves: f64,
    /// … elsewhere, where a parameter of the base model differs by more than this part (training bank).
    pub elsewhere: f64,
    /// A clock takes the pace of a base model if it leaves less than this part of the swing that that one leaves (judgement: a tenth).
    pub frequency_match_residual: f64,
    /// A fit whose χ² is this many times the best one's, and this much more, is not made any better (cost).
    pub hopeless: f64,
    /// A χ² that was this many times as large was not yet a minimum's: the noise is learnt again (training bank).
    pub far_down: f64,
    /// The best effects beside each of which every other one is sought again (cost).
    pub restart_seeds: usize,
    /// The best fits that are made anew from the first part of the recordings (cost).
    pub restarted: usize,
    /// That part of the rows, or less where the swing has fallen to `still` of its largest before (training bank).
    pub first_part: f64,
    /// See `first_part`.
    pub still: f64,
    /// A part of fewer swings tells losses and clocks from nothing (judgement).
    pub fewest_swings: f64,
    /// Fits that are followed from the beginning of the recordings (cost).
    pub begun: usize,
    /// Fits of each number of coefficients that are followed further (cost)…
    pub followed: usize,
    /// … of the first part of recordings of which the whole is dear so many altogether (cost)…
    pub carried: usize,
    /// … unless they leave more than this many times what the best of them does (cost).
    pub keeps_up: f64,
    /// Effects that an answer has at first (judgement: a bank of single effects and pairs has calibrated no more).
    pub main_effects: usize,
    /// Most effects of one hypothesis (training bank: of four several quartets did equally well)…
    pub most_effects: usize,
    /// … and most coefficients (judgement: two effects of one beside a support, which has three).
    pub most_coefficients: usize,
    /// Effects that are tried beside a fit that has some (cost).
    pub tried: usize,
    /// A fit that leaves more than this many times what the best one does leads nowhere (cost).
    pub leads: f64,
    /// Part of what one effect promises that another in its place must (training bank).
    pub most_of: f64,
    /// Turns of more and fewer effects (cost).
    pub turns: usize,
    /// Another count of rods must lower χ² by so many variances of the best fit (statistics: 3 σ of one number, as for any other).
    pub worth_a_count: f64,
    /// Where the best fit leaves this many variances of the noise, a wrong count may have led to it (training bank).
    pub count_unexplained: f64,
}

/// Which fits count.
#[derive(Debug, Clone)]
pub struct CertificateSettings {
    /// Two ends are one where their χ² differ by less than this many variances of what is left (statistics: 0.2 is a tenth of an ln-likelihood).
    pub agrees: f64,
    /// Independent starts that must end there (judgement).
    pub starts: usize,
    /// Fits that are given further starts until so many agree (cost)…
    pub most: usize,
    /// … of those that leave, and need, at most this much more than the best (statistics: beyond it odds are e⁻²⁵).
    pub within: f64,
}

/// How probable each hypothesis is.
#[derive(Debug, Clone)]
pub struct PriorSettings {
    /// ln R: coefficients over four decades (judgement: nobody knows beforehand how much a hinge rubs).
    pub sizes: f64,
    /// The same of yield angles: over a factor of thirty (judgement).
    pub yields: f64,
    /// Of a support's frequency, over the swing's (judgement).
    pub frequencies: f64,
    /// Standard deviation of the stretch and of the shear of a view, and of a gain: half the square of the angle by which it is askew (judgement: set up by eye, to some 20°).
    pub view: f64,
    /// Standard deviation of each part of an encoder's error, once and twice a turn (judgement: a disc of 10 mm read 0.1 mm off its axis has 10 mrad, and the data sheets of magnetic sensors allow 1°).
    pub encoder_rad: f64,
    /// Coefficients of less than this many standard deviations are not told from zero (statistics).
    pub min_significance: f64,
    /// From this variance on, over the noise's, a fall of χ² counts instead of a standard deviation (training bank).
    pub much_left: f64,
    /// Of nothing missing, of one effect, of two (judgement: as many of each as a laboratory has).
    pub none: f64,
    /// See `none`.
    pub one: f64,
    /// See `none`.
    pub two: f64,
    /// Three are this much less probable than two, and so on (judgement).
    pub further: f64,
    /// An effect of the camera is this much likelier than one of physics (judgement: in doubt it is the measurement).
    pub camera_first: f64,
    /// Of physics outside the table (judgement).
    pub unknown: f64,
    /// One or two names that leave less than this part of what the base model leaves beyond the noise are at work, whatever remains: laws outside the table were
    /// imitated by so few of it down to a hundredth (46 mrad fell to 5), never to a thousandth; by three down to 2·10⁻⁵ (judgement, not yet calibrated on a bank).
    pub imitated_down_to: f64,
    /// Decades of that part over which names that are at work may leave something (judgement: smoothed friction, a bent bearing, an encoder's steps).
    pub model_error_decades: f64,
    /// The part of inclusions of 0.9 and more that are right where the answer names nothing (rigs of three other simulators: 4 of 18).
    pub beside_no_answer: f64,
    /// The part of names that stand for something outside the table (training bank: names stated at 0.99 were right in 97 of 100 cases).
    pub imitated: f64,
    /// Each name that has not been held against every other effect, as those beyond two are not, and fewer where the budget ends before, or that may imitate a law of no
    /// table and has not been held against any, is with these odds what it seems to be (judgement: no bank has calibrated them).
    pub not_compared: f64,
    /// A support in step with the swing is with these odds what it seems to be (training bank: four times out of five).
    pub support_in_step: f64,
    /// Odds of a name that gains no more than the error of another name's law, and of a support that gains little; and beside what leaves more than noise, of an error of a
    /// sensor or of a view, and of a support in step with the swing: their free numbers complete any law that is only nearly right (training bank, of supports only).
    pub within_law_error: f64,
    /// That little, in standard deviations (training bank).
    pub slight: f64,
    /// A clock that jumps by a part of a frame, or runs back, is with these odds a camera's (judgement: frames are missing whole; it took up the errors of other laws).
    pub part_of_a_frame: f64,
}

/// Which answer that makes.
#[derive(Debug, Clone)]
pub struct VerdictSettings {
    /// A probability from which on something counts as likelier than not (statistics: the median probability model).
    pub even: f64,
    /// An answer stands alone when it is at least this probable (judgement: three to one).
    pub alone: f64,
    /// A hypothesis this much less probable than the best named one is told from it (statistics: 5 %).
    pub told_apart: f64,
    /// Where the best of the table leaves far more than noise, its names stand if they leave at most this part of what the base model leaves of what was not
    /// fitted (judgement: half)…
    pub proven: f64,
    /// There a further effect must leave at most this part of what fewer do of what was not fitted (training bank: the double arm's third passes)…
    pub borne_out: f64,
    /// … of so many sets of each number of effects, the likeliest (cost).
    pub sets_asked: usize,
    /// Part of a recording that is fitted; the rest is predicted (judgement).
    pub fitted: f64,
    /// Places are told from one another by this much in ln-likelihood (statistics: 20 to 1).
    pub places: f64,
    /// Residuals of the base model that chance leaves less often are not only noise (statistics: of recordings that lack nothing one in 200).
    pub chance: f64,
    /// An effect is seen at this many standard deviations (statistics)…
    pub seen: f64,
    /// … and named when it is this many from its nearest rival (judgement: what the concealed benchmark counts as strong).
    pub named: f64,
    /// Two effects whose signatures go together by more than this are not named apart at twice the size at which they are seen (statistics: less than
    /// 3 σ lie between them there).
    pub confused: f64,
}

/// What law is learnt beside an answer.
#[derive(Debug, Clone)]
pub struct LawSettings {
    /// A term of which the projection leaves less than this part does what is free already (judgement: a thousandth).
    pub nothing_left: f64,
    /// A term whose torque has this cosine with another's, or of whose effect on the angles what nothing else does has it with a name's, is the same under another name
    /// (judgement).
    pub the_same: f64,
    /// A term of the grammar with the shape of a law of the table, whose torque along the motion has this cosine with that law's, is that law (judgement: it is then
    /// more than half of the term, by squares; friction that is gone at a fifth of the largest speed has 0.5).
    pub the_same_law: f64,
    /// The foremost terms, each of which is paired with every one that promises less (cost).
    pub paired: usize,
    /// Terms, and pairs, begun beside each set of names at most (cost)…
    pub most: usize,
    /// … up to this part of what the budget allows; the rest is for those that are fitted to the end (cost).
    pub begun: f64,
    /// This part of the budget is for those that act in all of the swing; where none of them leaves only noise, this part of the rest is for those that short stretches ask
    /// for, and what is left for those that act in a part of the swing, too (cost).
    pub first: f64,
    /// Terms begun in the place of a name whose torque they nearly exert (cost).
    pub in_place: usize,
    /// After so many that promise more beside each set of names (cost).
    pub in_place_after: usize,
    /// The foremost fits are begun along the motion that names follow, too, where it allows so many (cost).
    pub along: f64,
    /// The shortest descriptions of which it is asked what they predict (cost).
    pub foretold: usize,
    /// Of none that is longer than the shortest by more nats, nor is one that is made simpler (statistics: odds are e⁻²⁵).
    pub far: f64,
    /// Other formulas are told whose description is longer by less than so many nats (statistics: beyond it odds are e⁻⁵).
    pub alternatives: f64,
}

impl Default for NoiseSettings {
    fn default() -> Self {
        Self {
            motion: 1e-7,
            leaks: 0.1,
            line: 25.0,
            enough: 0.15,
            most: 1.2,
            coloured: 6.0,
            beside: 3.0,
            together: 4.0,
            beyond: 5.0,
            grows: 1.5,
            changes: 0.03,
            stretches_coloured: 0.12,
        }
    }
}

impl Default for DescentSettings {
    fn default() -> Self {
        Self {
            first_steps: 4,
            few_steps: 12,
            most_steps: 30,
            enough: 0.02,
            hopeless_ratio: 10.0,
            strip_continue_ratio: 1.2,
        }
    }
}

impl Default for MisfitSettings {
    fn default() -> Self {
        Self { much: 0.05, out_of_step: 0.35, deviations: 4.0, little: 2.0, leads: 0.005, counts: 9.0, strays: 30.0 }
    }
}

impl Default for SearchSettings {
    fn default() -> Self {
        Self {
            budget: 160_000_000,
            shares: BudgetShares {
                prepared: 0.25,
                usual: 0.45,
                restarts: 0.6,
                certified: 0.7,
                further: 0.9,
                law: 0.9,
                all: 2.0,
                simpler: 0.2,
                strip: 1.2,
            },
            evaluations: 6400.0,
            early_swings: 12.0,
            part_worth: 0.6,
            piece_swings: 8.0,
            inertia_share: 0.1,
            com_share: 0.02,
            length_share: 0.005,
            encoder_zero_rad: 3e-3,
            asked: 3,
            pair_seeds: 6,
            expensive_seeds: 3,
            far: 100.0,
            afar: 0.01,
            most_pairs: 20,
            fewest_pairs: 6,
            promising: 3.0,
            leader_leaves: 0.5,
            elsewhere: 0.3,
            frequency_match_residual: 0.1,
            hopeless: 10.0,
            far_down: 3.0,
            restart_seeds: 2,
            restarted: 4,
            first_part: 0.5,
            still: 0.25,
            fewest_swings: 5.0,
            begun: 12,
            followed: 3,
            carried: 6,
            keeps_up: 2.0,
            main_effects: 2,
            most_effects: 3,
            most_coefficients: 5,
            tried: 6,
            leads: 2.0,
            most_of: 0.5,
            turns: 4,
            worth_a_count: 9.0,
            count_unexplained: 1.2,
        }
    }
}

impl SearchSettings {
    /// The budget of a search. Beside a strip no law is learnt: of what that may cost elsewhere a part is its search's.
    pub fn budget_of(&self, is_strip: bool) -> u64 {
        if is_strip { (self.shares.strip * self.budget as f64) as u64 } else { self.budget }
    }
}

impl Default for CertificateSettings {
    fn default() -> Self {
        Self { agrees: 0.2, starts: 3, most: 6, within: 50.0 }
    }
}

impl Default for PriorSettings {
    fn default() -> Self {
        Self {
            sizes: 9.2,
            yields: 3.4,
            frequencies: 10.0,
            view: 0.06,
            encoder_rad: 0.01,
            min_significance: 1.5,
            much_left: 4.0,
            none: 0.25,
            one: 0.40,
            two: 0.25,
            further: 0.2,
            camera_first: 2.0,
            unknown: 0.10,
            imitated_down_to: 1e-3,
            model_error_decades: 6.0,
            beside_no_answer: 0.25,
            imitated: 0.03,
            not_compared: 0.7,
            support_in_step: 0.8,
            within_law_error: 0.35,
            slight: 25.0,
            part_of_a_frame: 0.05,
        }
    }
}

impl PriorSettings {
    /// The odds that names are at work which leave this part of what the base model leaves beyond the noise. Both the error of a right law and that of an
    /// imitation are as likely to be of one size as of another, the first over more decades:
    ///
    /// ```text
    /// g = (1 − u)/m / ((1 − u)/m + u/k)     u: prior of something outside the table, m, k: decades of both errors
    /// ```
    pub fn odds_where_left(&self, part: f64) -> f64 {
        if part < self.imitated_down_to {
            return 1.0;
        }
        let right = (1.0 - self.unknown) / self.model_error_decades;
        let imitation = self.unknown / -self.imitated_down_to.log10();
        right / (right + imitation)
    }
}

impl Default for VerdictSettings {
    fn default() -> Self {
        Self {
            even: 0.5,
            alone: 0.75,
            told_apart: 0.05,
            proven: 0.5,
            borne_out: 0.9,
            chance: 0.005,
            sets_asked: 4,
            fitted: 2.0 / 3.0,
            places: 3.0,
            seen: 4.0,
            named: 5.0,
            confused: 0.93,
        }
    }
}

impl Default for LawSettings {
    fn default() -> Self {
        Self {
            nothing_left: 1e-3,
            the_same: 0.999,
            the_same_law: 0.71,
            paired: 12,
            most: 16,
            begun: 0.6,
            first: 0.5,
            in_place: 2,
            in_place_after: 2,
            along: 1000.0,
            foretold: 12,
            far: 25.0,
            alternatives: 5.0,
        }
    }
}
