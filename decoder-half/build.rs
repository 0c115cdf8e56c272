//! Says whether the processor has the DSP instructions of a Cortex-M4, which stable Rust does not tell crates: those of
//! `thumbv8m.main` need not have them.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(cortex_m_dsp)");
    if std::env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv7em-")) {
        println!("cargo::rustc-cfg=cortex_m_dsp");
    }
}
