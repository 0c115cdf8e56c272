//! The memory that a caller lends.

/// The scratch memory of a decoder: one region of bytes, or an array of two, the fast one first; of any alignment.
///
/// Both are [normal memory](crate#memory).
#[derive(Debug)]
pub struct Scratch<'s> {
    pub(super) fast: &'s mut [u8],
    pub(super) slow: &'s mut [u8],
}

impl<'s, T: AsMut<[u8]> + ?Sized> From<&'s mut T> for Scratch<'s> {
    fn from(fast: &'s mut T) -> Self {
        Self { fast: fast.as_mut(), slow: &mut [] }
    }
}

impl<'s, T: AsMut<[u8]> + ?Sized> From<[&'s mut T; 2]> for Scratch<'s> {
    fn from([fast, slow]: [&'s mut T; 2]) -> Self {
        Self { fast: fast.as_mut(), slow: slow.as_mut() }
    }
}
