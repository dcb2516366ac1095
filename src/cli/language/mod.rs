//! What the words of the language mean, as editors and `rfm explain` show it.

pub(super) mod keys;
pub(super) mod outputs;
pub(super) mod page;
pub(super) mod words;
