//! Keys whose values have several forms, and tables whose keys exclude each other: their shape, how they are read, and their echo.

mod body;
pub mod contact;
mod elasticity;
mod history;
mod layer;
mod method;
