//! Where the camera is above the table, as far as it matters for balls that hop.

/// A ball whose centre is by h above where it is on the cloth is seen displaced on the table, away from the foot of the camera, by
/// h (s + (p − m)/H): s is how much so in the middle m of the film, H how high the camera is. A ball with topspin hops after the impact, by
/// 0.5 mm at 2 m/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Viewpoint {
    /// s, m per m of height.
    pub slope: [f64; 2],
    /// 1/H, 1/m.
    pub per_metre: f64,
    /// m, m.
    pub middle: [f64; 2],
}

impl Viewpoint {
    /// By how much a ball at a place is seen displaced, m per m of height.
    pub(crate) fn displacement(&self, place: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| self.slope[i] + self.per_metre * (place[i] - self.middle[i]))
    }

    /// Whether heights are not seen.
    pub(crate) fn is_overhead(&self) -> bool {
        self.slope == [0.0; 2] && self.per_metre == 0.0
    }
}
