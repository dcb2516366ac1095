fn main() {
    let args: Vec<String> = std::env::args().collect();
    let program = rfm::Program::from_path(args[1].as_str()).unwrap_or_else(|e| panic!("{e}"));
    let scene = &program.module().scenes[0];
    let experiment =
        rfm::Experiment::of(&program, scene, rfm::Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let (mut s, _) = experiment.simulation(&program, scene).unwrap_or_else(|e| panic!("{e}"));
    let steps: usize = args[2].parse().unwrap();
    for k in 0..steps {
        s.step().unwrap_or_else(|e| panic!("{e}"));
        if k < 10 || k % (steps / 20).max(1) == 0 {
            let st = s.stats();
            let p = s.particles();
            let pm = p.pressure.iter().cloned().fold(0.0, f64::max);
            println!(
                "{k} t {:.5} it {:?} vmax {:.4} comp {:.5} pmax {:.1} E {:.3} {:.3}",
                s.time(),
                s.iterations(),
                st.max_speed,
                st.max_density_error,
                pm,
                st.kinetic_energy,
                st.potential_energy
            );
        }
    }
}
