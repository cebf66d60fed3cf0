//! The programs of `examples/` do what they say: they run to their end.

#[path = "../examples/custom_gauge.rs"]
mod custom_gauge;
#[path = "../examples/dam_break.rs"]
mod dam_break;
#[path = "../examples/parameter_loop.rs"]
mod parameter_loop;

#[test]
fn the_examples_run() {
    dam_break::main().expect("a dam break, read every tenth step");
    custom_gauge::main().expect("a gauge of one's own");
    parameter_loop::main().expect("a parameter loop");
}
