//! The processor with its board: runs an image, enters interrupts, notices resets.

use unicorn_engine::{Arch, ArmCpuModel, HookType, Mode, Prot, RegisterARM, Unicorn, uc_error};

use crate::board::{Behaviour, Board};
use crate::exceptions;
use crate::flash::{SECTOR_BYTES, SLOTS_BEGIN};
use crate::image::{FLASH_BEGIN, FLASH_BYTES, Image};
use crate::random::Random;
use crate::rcc::reset_flag;
use crate::system::{FIRST_INTERRUPT, NMI, TIM2};

/// RAM without the core-coupled part (memory.x).
const RAM_BEGIN: u64 = 0x2000_0000;
const RAM_BYTES: usize = 128 * 1024;

/// The instruction that waits for an interrupt.
const WFI: [u8; 2] = 0xBF30_u16.to_le_bytes();

/// A loop that never ends: a branch to itself.
const HANG: [u8; 2] = 0xE7FE_u16.to_le_bytes();

/// Ticks after which a pending interrupt is checked again, while it is masked: some instructions.
const MASKED_TICKS: u64 = crate::ticks::of_ns(300);

/// Ending of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// The time is over; the image runs on.
    Time,
    /// The program asked for a reset.
    Software,
    /// The watchdog was not fed.
    Watchdog,
    /// Power failed in an operation of the flash.
    PowerLost,
    /// An access that the processor cannot make, or an undefined instruction.
    Fault(String),
}

/// An image on its board.
pub struct Machine {
    cpu: Unicorn<'static, Board>,
    image: Image,
    pc: u32,
    in_handler: bool,
    /// The image's handler of the non-maskable interrupt does not return.
    in_nmi: bool,
    /// Address at which thread mode last slept, where `hang_main_loop` makes it hang; `None` before a sleep.
    hangs_at: Option<u64>,
    entered: u64,
    /// Longest time from entry into the sampling interrupt to its return \[ticks\].
    pub longest_interrupt: u64,
}

impl Machine {
    /// An image on a board that has just been powered, with these contents of the parameter slots.
    ///
    /// # Panics
    /// Unicorn does not start.
    pub fn new(image: &Image, behaviour: Behaviour, slots: [&[u8]; 2]) -> Self {
        let mut board = Board::new(behaviour, FLASH_BEGIN);
        for (place, block) in slots.into_iter().enumerate() {
            board.flash.store(place, block);
        }
        if image.is_behind_selector {
            board.flash.open_behind_selector(&image.flash);
        }
        let cpu = processor(image, board).expect("Unicorn maps the memory of this chip");
        let mut machine = Self {
            cpu,
            image: image.clone(),
            pc: 0,
            in_handler: false,
            in_nmi: false,
            hangs_at: None,
            entered: 0,
            longest_interrupt: 0,
        };
        machine.forget_memory(1);
        machine
            .start()
            .expect("Unicorn takes the processor's registers");
        machine
    }

    /// Address of the next instruction.
    pub fn pc(&self) -> u32 {
        self.pc
    }

    /// A word of memory at the symbol whose name contains every one of `parts`, at this offset.
    pub fn set_word(&mut self, parts: &[&str], offset: u32, word: u32) {
        let at = self.image.symbol(parts) + offset;
        self.write_memory(u64::from(at), &word.to_le_bytes());
    }

    /// A bit of RAM that reads the same whatever is written. In front of the first run.
    pub fn stick(&mut self, address: u32, bit: u32, level: bool) {
        let at = u64::from(address + bit / 8);
        let mask = 1 << (bit % 8);
        let stuck = move |cpu: &mut Unicorn<'_, Board>, _, _, _, _| {
            let mut byte = [0];
            let read = cpu.mem_read(at, &mut byte);
            let held = if level {
                byte[0] | mask
            } else {
                byte[0] & !mask
            };
            read.and_then(|()| cpu.mem_write(at, &[held])).is_ok()
        };
        let address = u64::from(address);
        self.cpu
            .add_mem_hook(HookType::MEM_READ, address, address + 3, stuck)
            .expect("a hook");
    }

    /// A bit of flash that changes by itself.
    pub fn flip_flash(&mut self, address: u32, bit: u32) {
        let at = u64::from(address);
        let mut byte = [0];
        self.cpu.mem_read(at, &mut byte).expect("mapped memory");
        self.write_memory(at, &[byte[0] ^ 1 << bit]);
        self.cpu
            .ctl_remove_cache(at, at + 1)
            .expect("mapped memory");
    }

    /// A floating-point register that has another bit whenever the instruction at `address` begins.
    pub fn upset_float(&mut self, address: u32, register: u32, bit: u32) {
        let register = RegisterARM::S0 as i32 + register as i32;
        let address = u64::from(address);
        let upset = move |cpu: &mut Unicorn<'_, Board>, _, _| {
            let value = cpu.reg_read(register).unwrap_or(0);
            // A failure would show as a fault that is not seen.
            let _ = cpu.reg_write(register, value ^ 1 << bit);
        };
        self.cpu
            .add_code_hook(address, address, upset)
            .expect("a hook");
    }

    /// The board.
    pub fn board(&mut self) -> &mut Board {
        self.cpu.get_data_mut()
    }

    /// Power comes back, `seed` for the content of memory; the flash keeps its content.
    pub fn power_on(&mut self, seed: u64) {
        self.forget_memory(seed);
        let board = self.board();
        board.flash.operations = 0;
        board.flash.erasures = 0;
        self.reset(reset_flag::POWER_ON);
    }

    /// The supply was below the brown-out level for a moment: memory is lost, the power-on reset's level was not reached.
    pub fn brown_out(&mut self, seed: u64) {
        self.forget_memory(seed);
        self.reset(reset_flag::BROWN_OUT);
    }

    /// Power-on with a word of memory that a reset before would have left, at the symbol whose name contains `symbol`.
    pub fn power_on_with(&mut self, seed: u64, symbol: &str, word: u32) {
        let at = self.image.symbol(&[symbol]);
        self.power_on(seed);
        self.write_memory(u64::from(at), &word.to_le_bytes());
    }

    /// Resets the processor by an ending, in memory that a reset keeps.
    ///
    /// # Panics
    /// No reset follows this ending by itself.
    pub fn follow(&mut self, ending: &Ending) {
        match ending {
            Ending::Software => self.reset(reset_flag::SOFTWARE),
            Ending::Watchdog => self.reset(reset_flag::WATCHDOG),
            other => panic!("no reset follows {other:?}"),
        }
    }

    fn reset(&mut self, flags: u32) {
        self.board().reset(flags);
        self.start()
            .expect("Unicorn takes the processor's registers");
    }

    fn forget_memory(&mut self, seed: u64) {
        let mut random = Random::new(seed);
        let bytes: Vec<u8> = (0..RAM_BYTES / 8)
            .flat_map(|_| random.bits().to_le_bytes())
            .collect();
        self.write_memory(RAM_BEGIN, &bytes);
    }

    fn write_memory(&mut self, at: u64, bytes: &[u8]) {
        self.cpu.mem_write(at, bytes).expect("mapped memory");
    }

    /// The processor after a reset: stack pointer and program counter from the vector table.
    fn start(&mut self) -> Result<(), uc_error> {
        show_changes(&mut self.cpu)?;
        (self.in_handler, self.in_nmi) = (false, false);
        for register in 0..13 {
            self.cpu.reg_write(RegisterARM::R0 as i32 + register, 0)?;
        }
        self.cpu.reg_write(RegisterARM::PRIMASK, 0)?;
        self.cpu
            .reg_write(RegisterARM::SP, u64::from(self.image.vector(0)))?;
        self.cpu.reg_write(RegisterARM::LR, 0xFFFF_FFFF)?;
        self.pc = self.image.vector(1) & !1;
        Ok(())
    }

    /// Hangs the main loop, with interrupts going on, the next time that it sleeps. There is no way back.
    pub fn hang_main_loop(&mut self) {
        if let Some(at) = self.hangs_at {
            self.write_memory(at, &HANG);
            self.cpu
                .ctl_remove_cache(at, at + 2)
                .expect("mapped memory");
        }
    }

    /// Undoes [`Self::hang_main_loop`], as flash would be after a reset.
    pub fn mend_main_loop(&mut self) {
        if let Some(at) = self.hangs_at {
            self.write_memory(at, &WFI);
            self.cpu
                .ctl_remove_cache(at, at + 2)
                .expect("mapped memory");
        }
    }

    /// Runs until `until` \[ticks since power-on\], or until something ends the run.
    pub fn run(&mut self, until: u64) -> Ending {
        loop {
            let board = self.cpu.get_data_mut();
            board.settle();
            if board.flash.has_lost_power {
                return Ending::PowerLost;
            }
            if board.system.wants_reset {
                return Ending::Software;
            }
            if board
                .watchdog
                .expires_at()
                .is_some_and(|at| board.now >= at)
            {
                return Ending::Watchdog;
            }
            if board.now >= until {
                return Ending::Time;
            }
            if board.cycle_ticks.is_none() {
                // Without a clock the processor stands; the watchdog has its own.
                board.now = board.next_event().min(until);
                continue;
            }
            if let Err(error) = self.run_on(until) {
                return Ending::Fault(format!("{error:?} at {:#010x}", self.pc));
            }
        }
    }

    /// Runs for so many ticks, or until something ends the run.
    pub fn run_for(&mut self, ticks: u64) -> Ending {
        let until = self.board().now + ticks;
        self.run(until)
    }

    /// Enters a requested exception, and runs until the next event.
    fn run_on(&mut self, until: u64) -> Result<(), uc_error> {
        let is_masked =
            self.cpu.reg_read(RegisterARM::PRIMASK)? & 1 != 0 || self.is_in_it_block()?;
        let board = self.cpu.get_data_mut();
        let exception = if board.rcc.requests_nmi() && !self.in_nmi {
            Some(NMI)
        } else if board.requests_sampling() && !self.in_handler && !is_masked {
            Some(FIRST_INTERRUPT + TIM2)
        } else {
            None
        };
        if let Some(number) = exception {
            let table = self.cpu.get_data().system.vectors();
            let mut handler = [0; 4];
            self.cpu
                .mem_read(u64::from(table + 4 * number), &mut handler)?;
            let handler = u32::from_le_bytes(handler);
            exceptions::enter(&mut self.cpu, self.pc, handler)?;
            (self.pc, self.in_handler) = (handler & !1, true);
            self.in_nmi |= number == NMI;
            self.entered = self.cpu.get_data().now;
        }
        self.move_stream_bytes()?;
        let in_handler = self.in_handler;
        let board = self.cpu.get_data_mut();
        let next = board.next_event();
        board.stop_at = match next <= board.now {
            // Requested, and neither entered nor the handler's own.
            true if in_handler || is_masked => until.min(board.now + MASKED_TICKS),
            _ => until.min(next),
        };
        board.has_stopped = false;
        let begin = u64::from(self.pc | 1);
        let outcome = self
            .cpu
            .emu_start(begin, u64::from(exceptions::RETURN & !1), 0, 0);
        self.pc = self.cpu.pc_read()? as u32 & !1;
        if self.pc == exceptions::RETURN & !1 {
            self.pc = exceptions::leave(&mut self.cpu)?;
            self.in_handler = false;
            let took = self.cpu.get_data().now - self.entered;
            self.longest_interrupt = self.longest_interrupt.max(took);
            return Ok(());
        }
        show_changes(&mut self.cpu)?;
        outcome?;
        self.sleep(until)
    }

    /// If the processor waits for an interrupt: lets the time pass until there is one.
    fn sleep(&mut self, until: u64) -> Result<(), uc_error> {
        if self.cpu.get_data().has_stopped {
            return Ok(());
        }
        let before = u64::from(self.pc) - 2;
        let mut instruction = [0; 2];
        self.cpu.mem_read(before, &mut instruction)?;
        if instruction != WFI {
            return Err(uc_error::EXCEPTION);
        }
        self.hangs_at = Some(before);
        let board = self.cpu.get_data_mut();
        let wakes = board
            .behaviour
            .wakes_after
            .map_or(u64::MAX, |ticks| board.now + ticks);
        board.now = board.now.max(board.next_event().min(wakes).min(until));
        Ok(())
    }

    fn is_in_it_block(&mut self) -> Result<bool, uc_error> {
        Ok(self.cpu.reg_read(RegisterARM::CPSR)? & 0x0600_FC00 != 0)
    }

    /// Moves the DMA stream's bytes up to now.
    fn move_stream_bytes(&mut self) -> Result<(), uc_error> {
        move_stream_bytes(&mut self.cpu)
    }
}

fn move_stream_bytes(cpu: &mut Unicorn<'_, Board>) -> Result<(), uc_error> {
    while let Some((address, at)) = cpu.get_data().stream_address() {
        let mut byte = [0];
        cpu.mem_read(u64::from(address), &mut byte)?;
        cpu.get_data_mut().stream_byte(byte[0], at);
    }
    Ok(())
}

/// A Cortex-M4 with this image in its flash and this board around it.
fn processor(image: &Image, board: Board) -> Result<Unicorn<'static, Board>, uc_error> {
    let mut cpu = Unicorn::new_with_data(Arch::ARM, Mode::MCLASS, board)?;
    cpu.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)?;
    let access = if image.is_behind_selector {
        Prot::ALL
    } else {
        Prot::READ | Prot::EXEC
    };
    cpu.mem_map(u64::from(FLASH_BEGIN), u64::from(FLASH_BYTES), access)?;
    cpu.mem_write(u64::from(FLASH_BEGIN), &image.flash)?;
    if image.is_behind_selector {
        program_code(&mut cpu)?;
    }
    cpu.mem_map(RAM_BEGIN, RAM_BYTES as u64, Prot::READ | Prot::WRITE)?;
    for (begin, bytes) in [
        (0x4000_0000, 0x3_0000),
        (0xE000_E000, 0x1000),
        (0xE004_2000, 0x1000),
    ] {
        let read = move |cpu: &mut Unicorn<'_, Board>, offset: u64, _: usize| {
            // The stream's result must be seen, and an error would show as a line that is silent.
            let _ = move_stream_bytes(cpu);
            u64::from(cpu.get_data_mut().read((begin + offset) as u32))
        };
        let write = move |cpu: &mut Unicorn<'_, Board>, offset: u64, _: usize, value: u64| {
            let _ = move_stream_bytes(cpu);
            cpu.get_data_mut()
                .write((begin + offset) as u32, value as u32);
        };
        cpu.mmio_map(begin, bytes, Some(read), Some(write))?;
    }
    let load = |cpu: &mut Unicorn<'_, Board>, offset: u64, bytes: usize| {
        let board = cpu.get_data_mut();
        let address = SLOTS_BEGIN + offset as u32;
        board.flash.load(address, bytes, &mut board.now)
    };
    let program = |cpu: &mut Unicorn<'_, Board>, offset: u64, bytes: usize, value: u64| {
        let board = cpu.get_data_mut();
        let address = SLOTS_BEGIN + offset as u32;
        let wrong = board.flash.program(address, bytes, value, &mut board.now);
        board.wrong.extend(wrong);
        board.stop_at = 0;
    };
    cpu.mmio_map(
        u64::from(SLOTS_BEGIN),
        2 * SECTOR_BYTES as u64,
        Some(load),
        Some(program),
    )?;
    count_instructions(&mut cpu)?;
    Ok(cpu)
}

/// Makes stores in front of the parameter slots programming. The store itself is overwritten by [`show_changes`] before the
/// next block of instructions.
fn program_code(cpu: &mut Unicorn<'static, Board>) -> Result<(), uc_error> {
    let (begin, end) = (FLASH_BEGIN, FLASH_BEGIN + FLASH_BYTES - 1);
    cpu.add_mem_hook(
        HookType::MEM_WRITE,
        u64::from(begin),
        u64::from(end),
        |cpu, _, address, bytes, value| {
            let board = cpu.get_data_mut();
            let address = address as u32;
            let program = board
                .flash
                .program(address, bytes, value as u64, &mut board.now);
            board.wrong.extend(program);
            let at = (address - FLASH_BEGIN) as usize;
            board.flash.changed.push((at, bytes));
            board.stop_at = 0;
            true
        },
    )?;
    Ok(())
}

/// Shows the processor the content of flash that an operation has changed.
fn show_changes(cpu: &mut Unicorn<'_, Board>) -> Result<(), uc_error> {
    let changed = std::mem::take(&mut cpu.get_data_mut().flash.changed);
    for (at, bytes) in changed {
        let content = cpu.get_data().flash.code[at..at + bytes].to_vec();
        let address = u64::from(FLASH_BEGIN) + at as u64;
        cpu.mem_write(address, &content)?;
        cpu.ctl_remove_cache(address, address + bytes as u64)?;
    }
    Ok(())
}

/// Lets the board's time pass with every block of instructions, and stops if the board asks for it.
fn count_instructions(cpu: &mut Unicorn<'static, Board>) -> Result<(), uc_error> {
    // By address of a block: its size when it was counted, and the count. One that was programmed since and has the same size
    // keeps its count.
    let mut counts = vec![(0, 0); FLASH_BYTES as usize / 2];
    let end = u64::from(FLASH_BEGIN + FLASH_BYTES);
    cpu.add_block_hook(u64::from(FLASH_BEGIN), end, move |cpu, address, bytes| {
        let board = cpu.get_data_mut();
        if board.now >= board.stop_at {
            board.has_stopped = true;
            let _ = cpu.emu_stop();
            return;
        }
        let at = (address - u64::from(FLASH_BEGIN)) as usize;
        let Some((counted, count)) = counts.get_mut(at / 2) else {
            return;
        };
        if *counted != bytes {
            let mut code = vec![0; bytes as usize];
            if cpu.mem_read(address, &mut code).is_ok() {
                (*counted, *count) = (bytes, instructions(&code));
            }
        }
        cpu.get_data_mut().pass(*count);
    })?;
    Ok(())
}

/// Number of instructions in Thumb code: one of 32 bits begins with 0b11101, 0b11110 or 0b11111 (ARMv7-M manual A5.1).
fn instructions(code: &[u8]) -> u64 {
    let mut halfwords = code
        .as_chunks::<2>()
        .0
        .iter()
        .map(|bytes| u16::from_le_bytes(*bytes));
    let mut count = 0;
    while let Some(halfword) = halfwords.next() {
        count += 1;
        if halfword >> 11 >= 0b11101 {
            halfwords.next();
        }
    }
    count
}
