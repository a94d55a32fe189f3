//! How far positions and angles lie from the truth of rendered recordings. The slow ones run with `make accuracy`.
