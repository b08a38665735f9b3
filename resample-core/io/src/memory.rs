//! How much memory this process may use, and sizes as people write them.

use std::fs::read_to_string;
use std::path::Path;

/// Where the system does not tell, bytes. A guess: what a small laptop has to spare.
const UNKNOWN_BYTES: u64 = 4 << 30;

/// Three quarters of the memory that the machine has, or that this process's control group or its own limits allow, bytes.
/// The rest is for the system, and for what a frame needs beside its data.
pub fn usual_budget() -> u64 {
    let limits = [machine_bytes(), group_bytes(), process_bytes()];
    let total = limits.into_iter().flatten().min();
    total.unwrap_or(UNKNOWN_BYTES) / 4 * 3
}

/// A number of bytes as people write it.
///
/// ```
/// use resample_io::memory::human;
///
/// assert_eq!(human(512), "512 bytes");
/// assert_eq!(human(3_500_000), "3.5 MB");
/// ```
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

/// The smaller one of the limits that a shell sets with `ulimit -v` and `ulimit -d`; Linux only.
fn process_bytes() -> Option<u64> {
    limit_in(&read_to_string("/proc/self/limits").ok()?)
}

/// The smallest soft limit on address space and data in the table of a process's limits; none where both are unlimited.
fn limit_in(table: &str) -> Option<u64> {
    let limits = ["Max address space", "Max data size"].map(|name| {
        let line = table.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse().ok()
    });
    limits.into_iter().flatten().min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_the_process_are_read() {
        let table = |space: &str, data: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max cpu time              unlimited            unlimited            seconds   \n\
                 Max data size             {data:<20} unlimited            bytes     \n\
                 Max address space         {space:<20} unlimited            bytes     \n"
            )
        };
        assert_eq!(limit_in(&table("unlimited", "unlimited")), None);
        assert_eq!(limit_in(&table("8589934592", "unlimited")), Some(8 << 30));
        assert_eq!(limit_in(&table("8589934592", "1048576")), Some(1 << 20));
        assert_eq!(limit_in(""), None);
    }

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
