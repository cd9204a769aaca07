mod nist;
mod optimise;
