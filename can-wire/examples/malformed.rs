//! Ten million service messages, most of them malformed, against the plain second opinion of the tests.
//!
//! `cargo run --profile desk -p can-wire --example malformed [MESSAGES] [SEED]` ends with a panic at the first one that
//! is not answered as documented or changes what it must not.

#[path = "../tests/reference/mod.rs"]
mod reference;

fn main() {
    let mut numbers = std::env::args().skip(1).map(|word| word.parse::<u64>().ok());
    let messages = numbers.next().flatten().unwrap_or(10_000_000);
    let seed = numbers.next().flatten().unwrap_or(1).max(1);
    let mut trial = reference::Trial::new(seed);
    for _ in 0..messages {
        trial.step();
    }
    let [silent, given_up, refused, taken] = trial.seen;
    println!("{messages} messages: {silent} ignored, {given_up} given up, {refused} refused, {taken} taken");
}
