//! Answers requests to the unit over the telemetry port: to stop, to take a parameter block, to start anew.
//!
//! From [`Request`]s it makes [`Answer`]s. A unit that samples answers `state` and `stop` and refuses everything else by name
//! ([`while_sampling`]); one that is stopped takes a block in pieces, each answered, and stores it ([`Service`]). Its
//! outcomes:
//!
//! | outcome | is | detail |
//! |---|---|---|
//! | 0 | done | of `store` the generation in force from the next start on, of `begin` and `data` the bytes received, of `state` the board's word ([`board_state`](crate::board_state)), of `self_test` its results ([`self_test`](crate::unit::self_test)) |
//! | 1 | the unit is running | 0 |
//! | 2 | no upload has begun | 0 |
//! | 3 | bytes out of order | bytes received |
//! | 4 | no block of this build has this length | the length |
//! | 5 | the block is not whole | bytes received |
//! | 6 | no magic of the block at its beginning | 0 |
//! | 7 | its version is not known | the version |
//! | 8 | its check sum does not match | the sum computed |
//! | 9 | its byte for accelerometers is neither 0 nor 1 | the byte found |
//! | 10 | a parameter is out of range | 0: the sender has the same check |
//! | 11 | it asks for a term that the build lacks | the term's kind |
//! | 12 | its records of terms are damaged | 0 |
//! | 13 | the supply is too low to write flash | 0 |
//! | 14 | flash reported an error | 0 |
//! | 15 | flash differs from the bytes written | 0 |
//! | 16 | there is no such request | its kind |
//! | 17 | the block is that of another unit | the last four bytes of this unit's number |
//! | 18 | an item of the block is not known, or not of this version | its kind |
//!
//! Requests about firmware images go to [`images`], where there are slots of them.
//!
//! The caller brings the bytes, the flash and the state of the supply, and starts the unit anew if [`Reply::restart`]
//! is set.

use embedded_storage::nor_flash::NorFlash;

use crate::chain::parameters::ParameterError;
use crate::chain::terms::{RecordError, TermKinds};
use crate::store::image_upload::ImageUpload;
use crate::store::parameter_block::BlockError;
use crate::store::parameter_slots::{Build, ParameterSlots, SlotError};
use crate::store::upload::{Upload, UploadError};
use crate::wire::service_frame::{Answer, Request, RequestKind};

pub mod images;

/// The outcome of a request that was carried out.
pub const DONE: u8 = 0;

/// The outcome of a request that a unit that samples refuses.
pub const RUNNING: u8 = 1;

/// The outcome of a block that asks for a term which the build lacks; its kind is the detail.
pub const TERM_ABSENT: u8 = 11;

/// The outcome of an unknown kind of request.
pub const UNKNOWN: u8 = 16;

/// The outcome of a block of another unit; the end of this unit's number is the detail.
pub const FOREIGN: u8 = 17;

/// The outcome of a block with an item that is not known.
pub const ITEM_UNKNOWN: u8 = 18;

/// Returns the meaning of an outcome, in words that begin with "the unit".
pub const fn meaning(outcome: u8) -> &'static str {
    match outcome {
        DONE => "the unit has done it",
        RUNNING => "the unit is running: uploads are taken only while it is stopped",
        2 => "the unit has not been told that an upload begins",
        3 => "the unit received bytes out of order",
        4 => "the unit's build takes no parameter block of this length",
        5 => "the unit has not received the whole parameter block",
        6 => "the unit received no parameter block: it does not begin with RLGP",
        7 => "the unit does not know the parameter block's version",
        8 => "the unit computes another check sum than the parameter block has",
        9 => "the unit cannot tell whether the parameter block has accelerometers",
        10 => "the unit refuses a parameter that is out of range",
        TERM_ABSENT => "the unit's build lacks a term that the parameter block asks for",
        12 => "the unit finds the parameter block's records damaged",
        13 => "the unit's supply is too low to write flash",
        14 => "the unit's flash reported an error; what was in force stays so",
        15 => "the unit's flash does not hold what was written; what was in force stays so",
        UNKNOWN => "the unit does not know this request",
        FOREIGN => "the unit refuses the parameter block of another unit",
        ITEM_UNKNOWN => "the unit does not know an item of the parameter block",
        images::NO_IMAGE_SLOTS => {
            "the unit runs an image without a boot selector, and has no slots for others"
        }
        20 => "the unit received no firmware image: it does not begin with RLGI",
        21 => "the unit does not know the layout of the firmware image",
        22 => "the unit is of another kind than the firmware image is for",
        images::IMAGE_ADDRESS => {
            "the unit's free slot is another than the firmware image is linked for"
        }
        24 => "the unit takes no firmware image of this length",
        25 => "the unit finds vectors of the firmware image that point outside RAM or code",
        26 => "the unit computes another check sum than the firmware image has",
        27 => "the unit has not received the whole firmware image",
        images::ON_TRIAL => "the unit's firmware image is on trial and not confirmed yet",
        _ => "the unit answered with an outcome that this version does not know",
    }
}

/// Outcome and detail of an error.
fn outcome<E>(error: &UploadError<E>) -> (u8, u32) {
    match error {
        UploadError::NotBegun => (2, 0),
        UploadError::Order(received) => (3, u32::from(*received)),
        UploadError::Length(length) => (4, u32::from(*length)),
        UploadError::Unfinished(received) => (5, u32::from(*received)),
        UploadError::Block(error) => match error {
            BlockError::Length(bytes) => (4, *bytes as u32),
            BlockError::Magic => (6, 0),
            BlockError::Version(version) => (7, u32::from(*version)),
            BlockError::Checksum { computed, .. } => (8, *computed),
            BlockError::Accelerometers(byte) => (9, u32::from(*byte)),
            BlockError::Response(_) => (10, 0),
            BlockError::Item(kind) => (ITEM_UNKNOWN, u32::from(*kind)),
            BlockError::Parameter(error) => of_parameter(error),
        },
        UploadError::OtherUnit(own) => (FOREIGN, own.short()),
        UploadError::SupplyLow => (13, 0),
        UploadError::Slot(error) => match error {
            SlotError::Parameter(error) => of_parameter(error),
            // Blocks of other units do not come as far as a slot.
            SlotError::Foreign(_) => (FOREIGN, 0),
            SlotError::Layout | SlotError::Flash(_) => (14, 0),
            SlotError::Verify => (15, 0),
        },
    }
}

fn of_parameter(error: &ParameterError) -> (u8, u32) {
    match error {
        ParameterError::TermAbsent(kind) | ParameterError::Records(RecordError::Full(kind)) => {
            (TERM_ABSENT, *kind as u32)
        }
        ParameterError::Records(_) => (12, 0),
        _ => (10, 0),
    }
}

/// Answers a request to a sampling unit; the flag is true if the unit is to stop. The details of `state`, `image_state` and
/// `self_test` are the caller's.
pub fn while_sampling(request: &Request, terms: TermKinds) -> (Answer, bool) {
    answer_while_sampling(request, terms, false)
}

/// As [`while_sampling`], of a firmware image on trial, which refuses to stop: its reset would end the trial.
pub fn while_on_trial(request: &Request, terms: TermKinds) -> Answer {
    answer_while_sampling(request, terms, true).0
}

fn answer_while_sampling(request: &Request, terms: TermKinds, on_trial: bool) -> (Answer, bool) {
    let (outcome, stop) = match RequestKind::from_number(request.kind) {
        Some(RequestKind::State | RequestKind::ImageState | RequestKind::SelfTest) => (DONE, false),
        Some(RequestKind::Stop) if on_trial => (images::ON_TRIAL, false),
        Some(RequestKind::Stop) => (DONE, true),
        Some(_) => (RUNNING, false),
        None => (UNKNOWN, false),
    };
    let answer = Answer {
        number: request.number,
        kind: request.kind,
        outcome,
        stopped: false,
        detail: 0,
        term_kinds: terms.bits(),
    };
    (answer, stop)
}

/// Reply of a stopped unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use = "the sender waits for the answer"]
pub struct Reply {
    /// The answer to send.
    pub answer: Answer,
    /// True if the unit starts anew once it is sent.
    pub restart: bool,
}

/// A stopped unit: its slots, and the block that is on its way.
#[derive(Debug)]
pub struct Service<F, B> {
    slots: ParameterSlots<F, B>,
    upload: Upload,
    terms: TermKinds,
}

impl<F: NorFlash, B: Build> Service<F, B> {
    /// Begins with nothing received. `terms`: the kinds that the build has.
    pub fn new(slots: ParameterSlots<F, B>, terms: TermKinds) -> Self {
        Self {
            slots,
            upload: Upload::default(),
            terms,
        }
    }

    /// Gives the slots back.
    pub fn release(self) -> ParameterSlots<F, B> {
        self.slots
    }

    /// Carries out a request. `supply_suffices` is called before flash is written. The details of `state` and `self_test` are
    /// the caller's, and the test of `run_self_test`, which is that of the next start.
    pub fn answer(&mut self, request: &Request, supply_suffices: impl FnOnce() -> bool) -> Reply {
        let mut restart = false;
        let done = match RequestKind::from_number(request.kind) {
            Some(RequestKind::State | RequestKind::Stop | RequestKind::SelfTest) => Ok(0),
            Some(RequestKind::Begin) => self.upload.begin(request.word).map(|()| 0),
            Some(RequestKind::Data) => {
                let put = self.upload.put(request.word, request.bytes());
                put.map(|()| u32::from(request.word) + u32::from(request.count))
            }
            Some(RequestKind::Store) => self.upload.store(&mut self.slots, supply_suffices()),
            Some(RequestKind::Restart | RequestKind::RunSelfTest) => {
                restart = true;
                Ok(0)
            }
            Some(kind) if kind.is_about_images() => {
                let answer = self.reply(request, images::NO_IMAGE_SLOTS, 0);
                return Reply { answer, restart };
            }
            _ => {
                let answer = self.reply(request, UNKNOWN, u32::from(request.kind));
                return Reply { answer, restart };
            }
        };
        let answer = match done {
            Ok(detail) => self.reply(request, DONE, detail),
            Err(error) => {
                let (outcome, detail) = outcome(&error);
                self.reply(request, outcome, detail)
            }
        };
        Reply { answer, restart }
    }

    /// Carries out a request about firmware images, on the slots of `upload`.
    pub fn answer_about_images<S: NorFlash, I: NorFlash>(
        &self,
        upload: &mut ImageUpload<S, I>,
        request: &Request,
        supply_suffices: impl FnOnce() -> bool,
    ) -> Reply {
        let (outcome, detail) = images::carry_out(upload, request, supply_suffices);
        Reply {
            answer: self.reply(request, outcome, detail),
            restart: false,
        }
    }

    fn reply(&self, request: &Request, outcome: u8, detail: u32) -> Answer {
        Answer {
            number: request.number,
            kind: request.kind,
            outcome,
            stopped: true,
            detail,
            term_kinds: self.terms.bits(),
        }
    }
}
