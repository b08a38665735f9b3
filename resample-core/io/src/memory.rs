//! How much memory this process may use, and sizes as people write them.

use std::fs::read_to_string;
use std::path::Path;

/// Where the system does not tell, bytes. A guess: what a small laptop has to spare.
const UNKNOWN_BYTES: u64 = 4 << 30;

/// Three quarters of the memory that the machine has, or that this process's control group allows, bytes. The rest is
/// for the system, and for what a frame needs beside its data.
pub fn usual_budget() -> u64 {
    let total = [machine_bytes(), group_bytes()].into_iter().flatten().min();
    total.unwrap_or(UNKNOWN_BYTES) / 4 * 3
}

/// A number of bytes as people write it.
pub fn human(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// The memory of the machine; Linux only.
fn machine_bytes() -> Option<u64> {
    let info = read_to_string("/proc/meminfo").ok()?;
    let line = info
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// The smallest limit of this process's control group and the groups around it; Linux only, version 2 and then 1.
fn group_bytes() -> Option<u64> {
    let groups = read_to_string("/proc/self/cgroup").ok()?;
    let limits = groups.lines().flat_map(|line| {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, group) = (fields.next().unwrap_or(""), fields.next().unwrap_or("/"));
        let (root, file) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            _ => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes"),
        };
        let is_memory =
            controllers.is_empty() || controllers.split(',').any(|name| name == "memory");
        let group = Path::new(group.trim_start_matches('/')).to_owned();
        let limit = move |group: &Path| -> Option<u64> {
            let text = read_to_string(Path::new(root).join(group).join(file)).ok()?;
            text.trim().parse().ok()
        };
        let groups: Vec<_> = group.ancestors().map(Path::to_owned).collect();
        groups
            .into_iter()
            .filter(move |_| is_memory)
            .filter_map(move |group| limit(&group))
    });
    limits.min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_budget_is_plausible() {
        let budget = usual_budget();
        assert!((64 << 20..1 << 50).contains(&budget), "{budget} bytes");
    }

    #[test]
    fn sizes_are_written_with_their_unit() {
        let written = [999, 1_500, 2_000_000, 3_400_000_000].map(human);
        assert_eq!(written, ["999 bytes", "1.5 kB", "2.0 MB", "3.4 GB"]);
    }
}
