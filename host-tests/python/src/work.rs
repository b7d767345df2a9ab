//! Runs work on a thread of its own, while Python's other threads run and Ctrl-C is handled.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use rlg::error::InputError;
use rlg::terminal::{Heard, Listener, Terminal};

use crate::error::{Names, raised};

/// Time between two checks of Python's signals: not noticeable.
const LOOK: Duration = Duration::from_millis(50);

/// Stack of a process's first thread on Linux, used by the command's work.
const STACK_BYTES: usize = 8 << 20;

/// Reaction to Ctrl-C during work, which stops at its next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AtInterrupt {
    /// Wait until it has stopped: it removes half-written files. A second Ctrl-C does not wait.
    Wait,
    /// Leave at once: it has written nothing.
    Leave,
}

/// Payload that unwinds through work to be stopped.
struct Stopped;

/// Message of the work's thread.
enum Said<T> {
    Step(String),
    Done(thread::Result<Result<T, InputError>>),
}

/// Runs `of` until it is done or Python has an exception to raise.
pub(crate) fn work<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    at_interrupt: AtInterrupt,
    names: Names,
    of: impl FnOnce(&Terminal) -> Result<T, InputError> + Send + 'static,
) -> PyResult<(T, Heard)> {
    let stop = Arc::new(AtomicBool::new(false));
    let (sender, mut receiver) = channel();
    let listener = listener(&stop, sender.clone());
    let terminal = Terminal::heard_by(Arc::clone(&listener));
    let run = move || {
        let done = catch_unwind(AssertUnwindSafe(|| of(&terminal)));
        // A receiver that no longer waits is ignored.
        let _ = sender.send(Said::Done(done));
    };
    thread::Builder::new()
        .name("rlg".to_owned())
        .stack_size(STACK_BYTES)
        .spawn(run)
        .map_err(|error| PyRuntimeError::new_err(format!("no thread can be started ({error})")))?;
    let done = match wait(py, &mut receiver, progress.as_ref()) {
        Ok(done) => done,
        Err(raised) => {
            stop.store(true, Ordering::Relaxed);
            if at_interrupt == AtInterrupt::Wait {
                let _: thread::Result<_> = wait(py, &mut receiver, None)?;
            }
            return Err(raised);
        }
    };
    match done {
        Ok(Ok(done)) => {
            let mut heard = listener.take();
            for warning in &mut heard.warnings {
                *warning = names.of(warning);
            }
            Ok((done, heard))
        }
        Ok(Err(error)) => Err(raised(py, &error, names)),
        Err(panic) => Err(PyRuntimeError::new_err(words(panic.as_ref()))),
    }
}

/// Forwards steps, and unwinds the work once it is to stop.
fn listener<T: Send + 'static>(stop: &Arc<AtomicBool>, sender: Sender<Said<T>>) -> Arc<Listener> {
    let stop = Arc::clone(stop);
    Listener::new(move |step| {
        if stop.load(Ordering::Relaxed) {
            // Not a panic: nothing is printed, and half-written files are removed on the way.
            resume_unwind(Box::new(Stopped));
        }
        let _ = sender.send(Said::Step(step.to_owned()));
    })
}

/// Waits for the work; meanwhile shows its steps to `progress` and lets Python handle its signals.
fn wait<T: Send>(
    py: Python<'_>,
    receiver: &mut Receiver<Said<T>>,
    progress: Option<&Py<PyAny>>,
) -> PyResult<thread::Result<Result<T, InputError>>> {
    loop {
        // Moved in, because a shared one may not leave its thread.
        let alone = &mut *receiver;
        match py.detach(move || alone.recv_timeout(LOOK)) {
            Ok(Said::Done(done)) => return Ok(done),
            Ok(Said::Step(step)) => {
                if let Some(progress) = progress {
                    progress.call1(py, (step,))?;
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the work ended without a word"));
            }
        }
        py.check_signals()?;
    }
}

/// Returns the message of a panic.
fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    format!("a fault of rlg itself: {}", text.unwrap_or("no words"))
}
