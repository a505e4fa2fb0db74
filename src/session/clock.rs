//! Clocks and memory as the operating system counts them.

use std::time::Instant;

/// Wall and processor time since some moment.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    wall: Instant,
    cpu: f64,
}

impl Stopwatch {
    /// Starts now.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: process_cpu_seconds() }
    }

    /// Seconds on the wall clock.
    pub fn seconds(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }

    /// Seconds of processor time of the whole process, all threads.
    pub fn cpu_seconds(&self) -> f64 {
        process_cpu_seconds() - self.cpu
    }
}

/// Processor time of the process so far.
#[allow(unsafe_code)]
fn process_cpu_seconds() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `t` is a valid timespec that the call only writes to.
    let ok = unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut t) } == 0;
    if ok { t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9 } else { 0.0 }
}

/// Most memory the process ever had in use, bytes.
#[allow(unsafe_code)]
pub fn peak_memory_bytes() -> u64 {
    // SAFETY: an all-zero rusage is valid, and the call only writes to it.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        libc::getrusage(libc::RUSAGE_SELF, &mut usage);
        usage
    };
    // Linux counts kibibytes
    usage.ru_maxrss as u64 * 1024
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn busy_time_is_counted() {
        let s = Stopwatch::start();
        let mut x = 0u64;
        while s.seconds() < 0.03 {
            x = std::hint::black_box(x + 1);
        }
        assert!(s.cpu_seconds() > 0.005 && s.cpu_seconds() < 60.0);
        assert!(peak_memory_bytes() > 1 << 20);
    }
}
