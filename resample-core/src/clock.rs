//! Wall and CPU time of the stages of a frame.

use std::ops::AddAssign;
use std::time::{Duration, Instant};

use cpu_time::{ProcessTime, ThreadTime};

/// Wall and process-CPU time of one stage, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StageTime {
    /// Elapsed time, ms. Stages that run interleaved share the frame's time in proportion to their CPU time.
    pub wall_ms: f64,
    /// CPU time of all threads together, ms.
    pub cpu_ms: f64,
}

/// Measures a stage.
#[derive(Clone, Copy, Debug)]
pub struct StageClock {
    wall: Instant,
    /// `None` where the system keeps no such clock; the stage's CPU time is then 0.
    cpu: Option<ProcessTime>,
}

/// Measures a part of a stage that runs on one thread.
#[derive(Clone, Copy, Debug)]
pub struct ThreadClock(Option<ThreadTime>);

impl StageClock {
    /// Starts now.
    pub fn start() -> Self {
        Self {
            wall: Instant::now(),
            cpu: ProcessTime::try_now().ok(),
        }
    }

    /// The time since the start.
    pub fn stop(self) -> StageTime {
        let cpu = self.cpu.and_then(|start| start.try_elapsed().ok());
        StageTime {
            wall_ms: ms(self.wall.elapsed()),
            cpu_ms: cpu.map_or(0.0, ms),
        }
    }
}

impl ThreadClock {
    /// Starts now.
    pub fn start() -> Self {
        Self(ThreadTime::try_now().ok())
    }

    /// Milliseconds of this thread's CPU time since the start; 0 where the system keeps no such clock.
    pub fn elapsed_ms(self) -> f64 {
        let elapsed = self.0.and_then(|start| start.try_elapsed().ok());
        elapsed.map_or(0.0, ms)
    }
}

impl AddAssign for StageTime {
    fn add_assign(&mut self, other: Self) {
        self.wall_ms += other.wall_ms;
        self.cpu_ms += other.cpu_ms;
    }
}

impl StageTime {
    /// Splits the time of stages that ran interleaved, in proportion to the CPU time measured inside each.
    pub fn shared<const N: usize>(self, cpu_ms: [f64; N]) -> [Self; N] {
        let total: f64 = cpu_ms.iter().sum();
        cpu_ms.map(|part| {
            let share = if total > 0.0 {
                part / total
            } else {
                1.0 / N as f64
            };
            Self {
                wall_ms: self.wall_ms * share,
                cpu_ms: self.cpu_ms * share,
            }
        })
    }
}

fn ms(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_follow_the_cpu_time_and_add_up() {
        let whole = StageTime {
            wall_ms: 6.0,
            cpu_ms: 12.0,
        };
        let [one, three] = whole.shared([1.0, 3.0]);
        assert_eq!([one.wall_ms, one.cpu_ms], [1.5, 3.0]);
        assert_eq!([three.wall_ms, three.cpu_ms], [4.5, 9.0]);
        let mut sum = one;
        sum += three;
        assert_eq!(sum, whole);
        // Stages too short for the clock share evenly.
        assert_eq!(whole.shared([0.0, 0.0]).map(|part| part.cpu_ms), [6.0; 2]);
    }

    #[test]
    fn clocks_run_forwards_in_milliseconds() {
        assert_eq!(ms(Duration::from_millis(1500)), 1500.0);
        let (stage, thread) = (StageClock::start(), ThreadClock::start());
        let start = Instant::now();
        let mut work = 0.0f64;
        while start.elapsed() < Duration::from_millis(20) {
            work += std::hint::black_box(1.0);
        }
        let time = stage.stop();
        assert!(work > 0.0 && time.wall_ms >= 20.0 && time.wall_ms < 20_000.0);
        // A thread that waits for a processor uses none; this one has used some.
        let is_counted = time.cpu_ms > 0.0 && thread.elapsed_ms() > 0.0;
        assert!(is_counted || !cfg!(target_os = "linux"));
    }
}
