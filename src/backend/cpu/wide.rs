//! AVX2 where the machine has it, found when the program runs.

/// Compiles a function twice, as for any machine and with AVX2, and calls the one that the machine can run. The
/// arithmetic is the same, bit for bit: nothing is reordered or contracted that is not written so.
macro_rules! wide {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident: $kind:ty),* $(,)?) $(-> $out:ty)? $body:block) => {
        $(#[$meta])*
        $vis fn $name($($arg: $kind),*) $(-> $out)? {
            #[inline(always)]
            fn any($($arg: $kind),*) $(-> $out)? $body

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2($($arg: $kind),*) $(-> $out)? {
                any($($arg),*)
            }

            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the machine has AVX2, checked just above.
                return unsafe { avx2($($arg),*) };
            }
            any($($arg),*)
        }
    };
}
pub(super) use wide;
