//! Processor time of another process.

use crate::loopback::Child;

/// User and system time of a child, s; where the system reports it.
pub(super) fn cpu_s(process: &Child) -> Option<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.process_id()?)).ok()?;
    // The name in brackets can hold any character. User and system time are fields 12 and 13 after it (proc(5)).
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let (user, system) = (fields.next()?.parse::<u64>().ok()?, fields.next()?.parse::<u64>().ok()?);
    Some((user + system) as f64 / rustix::param::clock_ticks_per_second() as f64)
}
