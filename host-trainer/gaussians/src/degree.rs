//! How much of the view direction a colour follows.

/// Highest degree of the spherical harmonics that make a colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Degree {
    /// One colour from all sides.
    #[default]
    Zero,
    /// 4 coefficients a channel.
    One,
    /// 9 coefficients a channel.
    Two,
    /// 16 coefficients a channel, as published.
    Three,
}

impl Degree {
    /// All, lowest first.
    pub const ALL: [Self; 4] = [Self::Zero, Self::One, Self::Two, Self::Three];

    /// The degree as a number, 0 to 3.
    pub const fn number(self) -> usize {
        self as usize
    }

    /// (degree + 1)²: coefficients of each colour channel.
    pub const fn n_coefficients(self) -> usize {
        (self.number() + 1) * (self.number() + 1)
    }

    /// The degree with so many coefficients a channel; `None` where there is none.
    pub fn with_coefficients(n_coefficients: usize) -> Option<Self> {
        Self::ALL.into_iter().find(|degree| degree.n_coefficients() == n_coefficients)
    }
}

#[cfg(test)]
mod tests {
    use super::Degree;

    #[test]
    fn a_degree_is_known_by_its_coefficients() {
        assert_eq!(Degree::ALL.map(Degree::n_coefficients), [1, 4, 9, 16]);
        for degree in Degree::ALL {
            assert_eq!(Degree::with_coefficients(degree.n_coefficients()), Some(degree));
        }
        assert_eq!(Degree::with_coefficients(5), None);
    }
}
