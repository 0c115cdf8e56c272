//! One loop, compiled for several instruction sets, chosen at run time.

use std::fmt;

/// The instruction sets that the loops are compiled for.
///
/// No multiplication is fused with an addition under any of them, so a loop gives the same bits under all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// What every CPU of the target has: SSE2 on x86-64, NEON on aarch64.
    Baseline,
    /// AVX2, 8 lanes of f32.
    Avx2,
    /// AVX-512, 16 lanes of f32.
    Avx512,
}

impl Level {
    /// The widest instruction set that this CPU has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi2");
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw");
            if avx2 && avx512 {
                return Self::Avx512;
            }
            if avx2 {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }

    /// Every level that this CPU has, narrowest first.
    pub fn available() -> impl Iterator<Item = Self> {
        let widest = Self::detect();
        [Self::Baseline, Self::Avx2, Self::Avx512].into_iter().filter(move |level| *level <= widest)
    }

    /// Runs `loops` compiled for this level.
    ///
    /// Only code that is inlined into the closure is compiled for the level: mark the closure and what it calls
    /// `#[inline(always)]`. (A closure is taken as `FnMut`: as `FnOnce` it would be called through a shim that stays at
    /// the baseline.)
    ///
    /// # Panics
    /// When the CPU has no such level.
    #[inline(always)]
    pub fn run<T>(self, mut loops: impl FnMut() -> T) -> T {
        match self {
            Self::Baseline => loops(),
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "functions with target features can be called only where the CPU has them")]
            // SAFETY: `detect` found the features that the function is compiled with.
            Self::Avx2 | Self::Avx512 => unsafe {
                assert!(self <= Self::widest(), "this CPU has no {self}");
                if self == Self::Avx512 { avx512(loops) } else { avx2(loops) }
            },
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => panic!("this CPU has no {self}"),
        }
    }

    /// [`Self::detect`], asked once.
    #[cfg(target_arch = "x86_64")]
    fn widest() -> Self {
        static WIDEST: std::sync::OnceLock<Level> = std::sync::OnceLock::new();
        *WIDEST.get_or_init(Self::detect)
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        })
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn avx512<T>(mut loops: impl FnMut() -> T) -> T {
    loops()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn avx2<T>(mut loops: impl FnMut() -> T) -> T {
    loops()
}
