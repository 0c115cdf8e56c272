//! What the system says about this process and its machine.

/// The largest amount of memory that this process has held, as Linux tells it.
pub(super) fn peak_memory_bytes() -> Option<u64> {
    kilobytes("/proc/self/status", "VmHWM:")
}

/// Lets [`peak_memory_bytes`] begin anew at what is held now, where the system can.
pub(super) fn forget_peak_memory() {
    // Without it the peak is only larger than it need be.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The memory of the machine, as Linux tells it.
pub(super) fn machine_memory_bytes() -> Option<u64> {
    kilobytes("/proc/meminfo", "MemTotal:")
}

fn kilobytes(path: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(path).ok()?;
    let value = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(1024 * value.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #[test]
    fn a_process_holds_less_than_its_machine() {
        let (own, machine) = (super::peak_memory_bytes().unwrap(), super::machine_memory_bytes().unwrap());
        assert!((1 << 20) < own && own < machine, "{own} of {machine}");
    }
}
