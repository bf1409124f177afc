//! A team of threads that share many short loops, as in a parallel region of OpenMP with a static schedule.
//!
//! Each member has a contiguous part of the tasks of every loop, and takes those of others only once its own are done. Where
//! loops of equal shape follow each other, what a task reads is then still in the cache of the core that wrote it: on two
//! threads that is worth 10 to 25 % of an iteration, against a thread pool that hands tasks to whoever comes. Members stay awake
//! from one loop to the next.

use std::any::Any;
use std::cell::{Cell, UnsafeCell};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::{hint, ptr, thread};

/// Looks at a number before a thread that waits lets others have its core.
const LOOKS: usize = 4096;

/// The body of a loop, which lives as long as any of its tasks is left.
type Body = *const (dyn Fn(usize) + Sync);

/// How many tasks of a member's part nobody has taken; on a cache line of its own.
#[repr(align(64))]
#[derive(Default)]
struct Open(AtomicUsize);

/// A loop at work. Whoever lowers `open` of a part has taken one of its tasks, and lowers `left` when that is done.
struct Team {
    /// By member.
    open: Vec<Open>,
    left: AtomicUsize,
    /// The number of tasks and the body. Written by the leader while no task is left, read by those who have taken one.
    present: UnsafeCell<(usize, Body)>,
    /// What a task panicked with.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
    is_over: AtomicBool,
}

// SAFETY: `present` is written while `left` is 0 (seen by an acquiring load), before any part is opened by a releasing
// store; it is read between an acquiring change of a part's `open` and a releasing one of `left`. So no two threads are at it at once. The body
// that it points to is `Sync`.
unsafe impl Sync for Team {}

/// What a loop is to do on this thread.
#[derive(Clone, Copy)]
enum Role {
    /// In no team: the thread pool is asked.
    Alone,
    /// Leads the team.
    Leader(*const Team),
    /// Within a task of a team.
    Member,
}

thread_local! {
    static ROLE: Cell<Role> = const { Cell::new(Role::Alone) };
}

/// Puts the role back that a thread had.
struct Before(Role);

impl Before {
    fn take(role: Role) -> Self {
        Before(ROLE.replace(role))
    }
}

impl Drop for Before {
    fn drop(&mut self) {
        ROLE.set(self.0);
    }
}

/// Does `work`, whose [loops](super) the threads of the pool share as a team. It must not wait for the pool in another way:
/// until it ends the team takes all threads that were idle. Within a task, loops are done by its thread alone.
pub fn team<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let members = rayon::current_num_threads();
    if members == 1 || !matches!(ROLE.get(), Role::Alone) {
        return work();
    }
    let team = &Team {
        open: (0..members).map(|_| Open::default()).collect(),
        left: AtomicUsize::new(0),
        present: UnsafeCell::new((0, ptr::null::<fn(usize)>() as Body)),
        panic: Mutex::new(None),
        is_over: AtomicBool::new(false),
    };
    rayon::scope(|scope| {
        // Those that are busy elsewhere may come late, or when all is over.
        (1..members).for_each(|member| scope.spawn(move |_| team.serve(member)));
        let _over = Over(team);
        let _before = Before::take(Role::Leader(team));
        work()
    })
}

/// Ends the team, also where the work panics.
struct Over<'a>(&'a Team);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.is_over.store(true, Ordering::Release);
    }
}

/// Calls `body(k)` for every k below `count`, once each, if this thread belongs to a team; else nothing is done, which is told.
pub(super) fn share(count: usize, body: &(dyn Fn(usize) + Sync)) -> bool {
    match ROLE.get() {
        Role::Alone => return false,
        Role::Member => (0..count).for_each(body),
        // SAFETY: `team` has set the role for as long as its team lives.
        Role::Leader(team) => unsafe { &*team }.each(count, body),
    }
    true
}

impl Team {
    /// The leader's part.
    fn each(&self, count: usize, body: &(dyn Fn(usize) + Sync)) {
        // SAFETY: only the lifetime changes. Nobody calls the body but for a task that it has taken, and this function does
        // not return before all are done.
        let body = unsafe { std::mem::transmute::<&(dyn Fn(usize) + Sync), &'static (dyn Fn(usize) + Sync)>(body) };
        // SAFETY: no task is left, neither of the loop before, whose end this thread has waited for, nor of this one.
        unsafe { *self.present.get() = (count, body) };
        self.left.store(count, Ordering::Relaxed);
        // The others' first, so that they find them before this thread's.
        for (part, open) in self.open.iter().enumerate().rev() {
            open.0.store(self.part(part, count).len(), Ordering::Release);
        }
        self.work(0);
        wait(|| self.left.load(Ordering::Acquire) == 0);
        let panic = self.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }

    /// What the others do.
    fn serve(&self, member: usize) {
        let is_over = || self.is_over.load(Ordering::Acquire);
        while !is_over() {
            self.work(member);
            wait(|| is_over() || self.open.iter().any(|open| open.0.load(Ordering::Relaxed) > 0));
        }
    }

    /// The tasks of a member, and what is left of the others' while there are none.
    fn work(&self, member: usize) {
        let parts = self.open.len();
        let mut others = 0;
        while others < parts {
            let part = (member + others) % parts;
            others = if self.take(part, &self.open[part].0) { 0 } else { others + 1 };
        }
    }

    /// The tasks of one part of all.
    fn part(&self, part: usize, count: usize) -> Range<usize> {
        let parts = self.open.len();
        part * count / parts..(part + 1) * count / parts
    }

    /// Takes a task of a part and does it; false if there is none.
    fn take(&self, part: usize, open: &AtomicUsize) -> bool {
        let lower = |open: usize| open.checked_sub(1);
        let Ok(open) = open.fetch_update(Ordering::Acquire, Ordering::Relaxed, lower) else {
            return false;
        };
        // SAFETY: a task of the present loop is taken and not done.
        let (count, body) = unsafe { *self.present.get() };
        let _before = Before::take(Role::Member);
        // SAFETY: the body lives until this task is done.
        let done = catch_unwind(AssertUnwindSafe(|| unsafe { &*body }(self.part(part, count).end - open)));
        if let Err(panic) = done {
            self.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).get_or_insert(panic);
        }
        self.left.fetch_sub(1, Ordering::Release);
        true
    }
}

fn wait(until: impl Fn() -> bool) {
    let mut looks = 0;
    while !until() {
        if looks < LOOKS {
            looks += 1;
            hint::spin_loop();
        } else {
            thread::yield_now();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};
    use std::sync::atomic::AtomicU32;

    use super::*;
    use crate::parallel;

    fn on(threads: usize, work: impl FnOnce() + Send) {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work);
    }

    #[test]
    fn every_task_of_many_loops_is_done_once_and_none_too_early() {
        for threads in [1, 2, 3, 8] {
            on(threads, || {
                // Each loop reads what the one before it has written, at places of other tasks.
                let n = 1000;
                let mut sums = vec![1u64; n];
                let mut expected = sums.clone();
                team(|| {
                    for round in 0..500 {
                        let before = sums.clone();
                        let size = 1 + round % 37;
                        parallel::chunks(&mut sums, size, |first, part| {
                            for (i, sum) in (first..).zip(part) {
                                *sum = before[i].wrapping_mul(3).wrapping_add(before[(i + n / 2) % n]);
                            }
                        });
                    }
                });
                for _ in 0..500 {
                    let before = expected.clone();
                    for (i, sum) in expected.iter_mut().enumerate() {
                        *sum = before[i].wrapping_mul(3).wrapping_add(before[(i + n / 2) % n]);
                    }
                }
                assert_eq!(sums, expected, "{threads} threads");
            });
        }
    }

    #[test]
    fn all_members_take_part() {
        on(4, || {
            let ids = Mutex::new(HashSet::new());
            let met = AtomicU32::new(0);
            team(|| {
                // None can end before all have begun.
                super::share(4, &|_| {
                    ids.lock().unwrap().insert(thread::current().id());
                    met.fetch_add(1, Ordering::Relaxed);
                    wait(|| met.load(Ordering::Relaxed) == 4);
                });
            });
            assert_eq!(ids.into_inner().unwrap().len(), 4);
        });
    }

    #[test]
    fn each_member_begins_with_its_own_part() {
        on(3, || {
            let first = Mutex::new(HashMap::new());
            let met = || first.lock().unwrap().len();
            let mut expected = 0;
            for _ in 0..40 {
                first.lock().unwrap().clear();
                team(|| {
                    share(60, &|k| {
                        first.lock().unwrap().entry(thread::current().id()).or_insert(k);
                        wait(|| met() == 3);
                    });
                });
                let mut tasks: Vec<usize> = first.lock().unwrap().values().copied().collect();
                tasks.sort_unstable();
                expected += u32::from(tasks == [0, 20, 40]);
            }
            // But where a member looks while the leader is about to open the parts.
            assert!(expected >= 30, "{expected} of 40");
        });
    }

    #[test]
    fn loops_in_tasks_and_teams_in_teams_come_to_their_end() {
        on(3, || {
            let count = AtomicU32::new(0);
            let add = |_| {
                count.fetch_add(1, Ordering::Relaxed);
            };
            team(|| {
                parallel::each(10_000, add);
                share(5, &|_| {
                    parallel::each(10_000, add);
                    team(|| parallel::each(100, add));
                });
                team(|| parallel::each(7, add));
            });
            // Several at once, whose members are each other's leaders.
            rayon::scope(|scope| {
                for _ in 0..6 {
                    scope.spawn(|_| team(|| (0..50).for_each(|_| parallel::each(9000, add))));
                }
            });
            assert_eq!(count.into_inner(), 60_000 + 500 + 7 + 6 * 50 * 9000);
        });
    }

    #[test]
    fn a_panic_ends_the_loop_and_reaches_the_caller() {
        on(3, || {
            for bad in [0, 17, 99] {
                let done = AtomicU32::new(0);
                let outcome = catch_unwind(AssertUnwindSafe(|| {
                    team(|| {
                        share(100, &|k| {
                            assert_ne!(k, bad, "this one");
                            done.fetch_add(1, Ordering::Relaxed);
                        });
                        unreachable!("the loop did not end");
                    })
                }));
                let panic = outcome.unwrap_err();
                assert!(panic.downcast_ref::<String>().unwrap().contains("this one"));
                assert_eq!(done.into_inner(), 99);
            }
            // The pool is as it was.
            assert_eq!(parallel::map(10_000, 10, |range| range.len()).into_iter().sum::<usize>(), 10_000);
        });
    }
}
