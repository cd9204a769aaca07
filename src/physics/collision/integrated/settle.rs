//! Which contacts slide, stick or open where the grips of some of them have just changed.

use super::dynamics::{Dynamics, Give, Grip, Grips, Site, Slips, at, norm, unit};

impl Dynamics {
    /// Whether a contact can bring friction to bear at all.
    pub fn has_friction(&self, site: Site) -> bool {
        match site {
            Site::Balls => true,
            Site::CueOnCloth => self.mu_k > 0.0,
            Site::ObjectOnCloth => self.mu_s > 0.0 && self.cloth_turning,
        }
    }

    /// Decides the grip of all contacts but `held`, whose grip is given: a contact without slip sticks
    /// if its friction can hold it; a ball that the cloth would have to pull down flies.
    pub fn settle(
        &self,
        mut grips: Grips,
        held: Option<Site>,
        slips: &Slips,
        normal: f64,
        give: &Give,
    ) -> Grips {
        let gives_way = |site: Site| site == Site::Balls && self.kappa > 0.0;
        for site in Site::ALL.into_iter().filter(|site| Some(*site) != held) {
            if grips[site] != Grip::Open && !gives_way(site) {
                let slips_not = norm(slips.0[site as usize]) <= self.no_slip[site as usize];
                grips[site] = match grips[site] {
                    _ if slips_not && self.has_friction(site) => Grip::Sticks,
                    Grip::Sticks | Grip::Creeps => Grip::Slides,
                    grip => grip,
                };
            }
        }
        // each pass opens or frees at least one contact
        for _ in 0..2 * Site::ALL.len() {
            let forces = self.forces(&grips, slips, normal, give);
            let mut settled = true;
            for site in Site::ALL.into_iter().filter(|site| Some(*site) != held) {
                let i = site as usize;
                if site != Site::Balls && grips[site] != Grip::Open && forces.normal[i] < 0.0 {
                    grips[site] = Grip::Open;
                    settled = false;
                } else if grips[site] == Grip::Starts
                    && norm(slips.0[i]) > self.no_slip[i]
                    && self.starts_for(site, &grips, slips, &forces) < 0.0
                {
                    grips[site] = Grip::Slides;
                    settled = false;
                } else if grips[site] == Grip::Sticks && norm(forces.friction[i]) > forces.most[i] {
                    grips[site] = Grip::Starts;
                    settled = false;
                }
            }
            if settled {
                break;
            }
        }
        // friction that is only about to set in, or to end, turns nothing
        let forces = self.forces(&grips, slips, normal, give);
        for site in Site::ALL {
            let i = site as usize;
            if grips[site] == Grip::Starts
                && self.turned_by(site, &forces) <= norm(slips.0[i]).max(self.no_slip[i])
            {
                grips[site] = Grip::Creeps;
            }
        }
        grips
    }

    /// What the cloth takes off a ball's slip that lands on it with `fallen`: at most its coefficient
    /// times that, at most what stops the slip.
    pub fn landing_friction(&self, q: f64, y: &mut [f64], site: Site, fallen: f64) {
        let (mu, x, lever, mass) = match site {
            Site::CueOnCloth => (self.mu_k, at::C_X, 1.0 + 1.0 / self.nu_c, 1.0 / self.per_r),
            _ if self.cloth_turning => (self.mu_s, at::O_X, 1.0 + self.sigma / self.nu, 1.0),
            _ => return,
        };
        let slip = self.slips(q, y).0[site as usize];
        let impulse = mass * (mu * fallen).min(norm(slip) / lever);
        for (i, direction) in unit(slip).into_iter().enumerate() {
            y[x + i] -= impulse * direction;
        }
    }
}
