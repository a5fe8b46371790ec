//! The page of [`on_target::report`], then the rivals run once for the emulator to count.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
mod chip {
    use core::fmt::Write;
    use core::hint::black_box;
    use model_core::fixed::{self, Newtons, ViscousSpeed};
    use on_target::rivals;
    use semihosting::io::Write as _;

    /// Lines go to the host through semihosting.
    struct Host(semihosting::io::Stdout);
    impl Write for Host {
        fn write_str(&mut self, text: &str) -> core::fmt::Result {
            self.0.write_all(text.as_bytes()).map_err(|_| core::fmt::Error)
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let Ok(out) = semihosting::io::stdout() else { semihosting::process::exit(2) };
        let mut host = Host(out);
        let written = on_target::report(&mut host);
        let law = on_target::SLIP_LAW.to_f32();
        if let Ok(fixed) = fixed::Reduced::of(&on_target::SLIP_LAW) {
            for p in on_target::points(on_target::SLIP).take(200) {
                let (force, viscous_speed) = (p.drag_force_n, p.viscous_speed);
                black_box(rivals::invert_float(&law, force, viscous_speed));
                black_box(rivals::preload_own(&law, force, viscous_speed));
                black_box(rivals::preload_libm(&law, force, viscous_speed));
                black_box(rivals::preload_micromath(&law, force, viscous_speed));
                let (force, viscous_speed) = (Newtons::from_f32(force), ViscousSpeed::from_f32(viscous_speed));
                black_box(rivals::invert_fixed(&fixed, force, viscous_speed));
            }
        }
        semihosting::process::exit(i32::from(written.is_err()))
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    let mut page = String::new();
    match on_target::report(&mut page) {
        Ok(()) => {
            print!("{page}");
            std::process::ExitCode::SUCCESS
        }
        Err(_) => std::process::ExitCode::FAILURE,
    }
}
