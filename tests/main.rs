//! The integration tests: the solver against analytic results and against itself on the device, the studies, the
//! program as a user meets it. One binary, linked once; `cargo test --release --test seixo NAME` runs a part.
#![allow(missing_docs)]

mod common;

mod allocation;
mod case;
mod cases;
mod cli;
mod compare;
mod compare_runs;
mod contact;
mod contact_device;
mod contact_hard;
mod device;
mod errors;
mod examples;
mod faults;
mod filled;
mod first_minute;
mod fluid;
mod fuzz;
mod gauges;
mod guide;
mod hulls;
mod immersed;
mod kernels;
mod large;
mod layers;
mod ledger;
mod measure;
mod meshes;
mod motion_file;
mod openings;
mod output;
mod output_fields;
mod packages;
mod periodic;
mod prisms;
mod ranks;
mod ranks_gpu;
mod render;
mod report;
mod restart;
mod scene;
mod seams;
mod settle;
mod shaders;
mod shaped;
mod shapes;
mod slots;
mod stability;
mod study;
mod surface;
mod twins;
mod wall_layers;
mod water;
