//! Every integration test is a module of this one binary, so that it links the library once.

mod auto;
mod batch;
mod cli;
mod collisions;
mod compare;
mod design;
mod discs;
mod effects;
mod extraction;
mod frames;
mod friendly;
mod hard;
mod integrated;
mod joint;
mod large;
mod loader;
mod nist;
mod optimise;
mod plain;
mod published;
mod recovery;
mod report;
mod shipped;
mod statistics;
mod tracks;
mod unusable;
