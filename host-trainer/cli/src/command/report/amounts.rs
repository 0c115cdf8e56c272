//! Amounts of memory as the pages write them.

use crate::plot::thousands;

/// Bytes, KiB, MiB or GiB: the rule of the viewer's page (`bytes` of viewer/web/figures.js), so that one file has one size on all pages.
pub(in crate::command) fn size(bytes: f64) -> String {
    const KIB: f64 = 1024.0;
    let short = |n: f64| format!("{n:.*}", if n < 100.0 { 2 } else { 0 });
    if bytes >= KIB * KIB * KIB {
        format!("{} GiB", short(bytes / (KIB * KIB * KIB)))
    } else if bytes >= KIB * KIB {
        format!("{} MiB", short(bytes / (KIB * KIB)))
    } else if bytes >= 10.0 * KIB {
        format!("{:.0} KiB", bytes / KIB)
    } else {
        format!("{} B", thousands(bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::size;

    #[test]
    fn a_size_has_the_unit_that_keeps_it_short() {
        let sizes = [0.0, 9_999.0, 10_240.0, 140_456.0, 1_048_576.0, 115_123_456.0, 1.5 * 1_073_741_824.0].map(size);
        assert_eq!(sizes, ["0 B", "9,999 B", "10 KiB", "137 KiB", "1.00 MiB", "110 MiB", "1.50 GiB"]);
    }
}
