#![doc = "Counts the cycles that a program takes on a Cortex-M4 by ARM's table, while QEMU runs it: `-plugin libcycles.so`."]
//!
//! `dbg #1` begins a stretch of code, `dbg #2` ends it; each prints one row, `cycles,CORE,NUMBER,INSTRUCTIONS,CYCLES`. Cores count each for
//! itself. On a processor both do nothing. The interface is that of QEMU's `qemu-plugin.h`, version 1.

mod thumb;

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::sync::atomic::{AtomicU64, Ordering};

use thumb::{Cost, cost};

type Id = u64;
/// Opaque: a block of instructions that QEMU translates at once, and one of them.
type TranslationBlock = c_void;
type Instruction = c_void;

/// Cycles to refill the pipeline after a branch that is taken: the manual says 1 to 3.
const REFILL: u64 = 2;
/// No register is looked at.
const NO_REGISTERS: c_int = 0;

unsafe extern "C" {
    fn qemu_plugin_register_vcpu_tb_trans_cb(id: Id, callback: extern "C" fn(Id, *mut TranslationBlock));
    fn qemu_plugin_tb_n_insns(block: *const TranslationBlock) -> usize;
    fn qemu_plugin_tb_get_insn(block: *const TranslationBlock, index: usize) -> *mut Instruction;
    fn qemu_plugin_insn_data(instruction: *const Instruction) -> *const c_void;
    fn qemu_plugin_insn_size(instruction: *const Instruction) -> usize;
    fn qemu_plugin_insn_vaddr(instruction: *const Instruction) -> u64;
    fn qemu_plugin_register_vcpu_tb_exec_cb(
        block: *mut TranslationBlock,
        callback: extern "C" fn(c_uint, *mut c_void),
        flags: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_register_vcpu_insn_exec_cb(
        instruction: *mut Instruction,
        callback: extern "C" fn(c_uint, *mut c_void),
        flags: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_outs(text: *const c_char);
}

/// The version of the interface.
#[unsafe(no_mangle)]
pub static qemu_plugin_version: c_int = 1;

/// What a block adds each time.
struct Block {
    n_instructions: u64,
    cycles: u64,
    start: u64,
    /// Where a block begins that is come to without a branch.
    end: u64,
}

/// What is counted of a core.
struct Counts {
    instructions: AtomicU64,
    cycles: AtomicU64,
    /// The end of the block before.
    end: AtomicU64,
    /// Both counts where the stretch began, and how many stretches there were.
    began: [AtomicU64; 2],
    n_stretches: AtomicU64,
}

impl Counts {
    const fn new() -> Self {
        let [instructions, cycles, end, n_stretches] = [const { AtomicU64::new(0) }; 4];
        Self { instructions, cycles, end, began: [const { AtomicU64::new(0) }; 2], n_stretches }
    }
}

static COUNTS: [Counts; 2] = [const { Counts::new() }; 2];

/// QEMU calls it once.
#[unsafe(no_mangle)]
pub extern "C" fn qemu_plugin_install(id: Id, _: *const c_void, _: c_int, _: *const *const c_char) -> c_int {
    // SAFETY: the identifier is the one that QEMU gave.
    unsafe { qemu_plugin_register_vcpu_tb_trans_cb(id, translated) };
    0
}

extern "C" fn translated(_: Id, block: *mut TranslationBlock) {
    let (mut cycles, mut before) = (0, Cost::default());
    let (mut start, mut end) = (0, 0);
    // SAFETY: `block` and its instructions are QEMU's, valid during this call; an instruction has 2 or 4 bytes.
    unsafe {
        let n_instructions = qemu_plugin_tb_n_insns(block);
        for index in 0..n_instructions {
            let instruction = qemu_plugin_tb_get_insn(block, index);
            let (address, size) = (qemu_plugin_insn_vaddr(instruction), qemu_plugin_insn_size(instruction));
            let code = qemu_plugin_insn_data(instruction).cast::<[u8; 2]>();
            let first = u16::from_le_bytes(code.read());
            let second = (size == 4).then(|| u16::from_le_bytes(code.add(1).read()));
            match (first, second) {
                (0xF3AF, Some(0x80F1)) => {
                    qemu_plugin_register_vcpu_insn_exec_cb(instruction, began, NO_REGISTERS, std::ptr::null_mut());
                }
                (0xF3AF, Some(0x80F2)) => {
                    qemu_plugin_register_vcpu_insn_exec_cb(instruction, ended, NO_REGISTERS, std::ptr::null_mut());
                }
                _ => {}
            }
            let cost = cost(first, second);
            cycles += u64::from(cost.behind(&before));
            before = cost;
            if index == 0 {
                start = address;
            }
            end = address + size as u64;
        }
        // QEMU keeps it as long as the program runs.
        let counted = Box::into_raw(Box::new(Block { n_instructions: n_instructions as u64, cycles, start, end }));
        qemu_plugin_register_vcpu_tb_exec_cb(block, executed, NO_REGISTERS, counted.cast());
    }
}

extern "C" fn executed(core: c_uint, block: *mut c_void) {
    // SAFETY: what `translated` gave, which is never freed.
    let block = unsafe { &*block.cast::<Block>() };
    let Some(counts) = COUNTS.get(core as usize) else { return };
    let refill = if counts.end.swap(block.end, Ordering::Relaxed) == block.start { 0 } else { REFILL };
    counts.instructions.fetch_add(block.n_instructions, Ordering::Relaxed);
    counts.cycles.fetch_add(block.cycles + refill, Ordering::Relaxed);
}

extern "C" fn began(core: c_uint, _: *mut c_void) {
    let Some(counts) = COUNTS.get(core as usize) else { return };
    for (began, count) in counts.began.iter().zip([&counts.instructions, &counts.cycles]) {
        began.store(count.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}

extern "C" fn ended(core: c_uint, _: *mut c_void) {
    let Some(counts) = COUNTS.get(core as usize) else { return };
    let number = counts.n_stretches.fetch_add(1, Ordering::Relaxed);
    let spent = |index: usize, count: &AtomicU64| {
        count.load(Ordering::Relaxed).wrapping_sub(counts.began[index].load(Ordering::Relaxed))
    };
    let row = format!("cycles,{core},{number},{},{}\n", spent(0, &counts.instructions), spent(1, &counts.cycles));
    if let Ok(row) = CString::new(row) {
        // SAFETY: a string that ends with a zero.
        unsafe { qemu_plugin_outs(row.as_ptr()) };
    }
}
