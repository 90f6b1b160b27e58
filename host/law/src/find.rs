//! From the name of a law to an opened library: folders that are [searched](search), files that are [inspected](inspect)
//! without running them, hashes that are [expected](expected_hashes), libraries that are [opened](opener).

pub(crate) mod expected_hashes;
pub mod inspect;
pub(crate) mod opened;
pub(crate) mod opener;
pub(crate) mod search;
