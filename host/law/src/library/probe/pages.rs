//! Memory with chosen neighbours.

use serde::{Deserialize, Serialize};
use std::io;

/// What lies next to an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fence {
    /// At least a page of ordinary memory on both sides.
    Far,
    /// Memory that must not be touched starts right after it.
    After,
    /// Memory that must not be touched ends right before it.
    Before,
}

/// Bytes in their own pages, or, where nothing is forbidden, of the heap, which takes fewer calls of the system.
/// Without `mmap` there are no fences and no locks.
#[derive(Debug)]
pub(super) struct Pages {
    place: Place,
    offset: usize,
    length: usize,
}

impl Pages {
    pub(super) fn new(length: usize, fence: Fence) -> io::Result<Self> {
        let page = page_size();
        let inner = length.next_multiple_of(page).max(page);
        let place = match fence {
            Fence::Far => Place::Heap(Heap::new(length + 2 * page)),
            Fence::After => Place::Map(Map::new(inner + 2 * page, Some(page + inner))?),
            Fence::Before => Place::Map(Map::new(inner + 2 * page, Some(0))?),
        };
        let offset = match fence {
            Fence::After => page + inner - length,
            Fence::Far | Fence::Before => page,
        };
        let mut pages = Self {
            place,
            offset,
            length,
        };
        if fence != Fence::Far {
            // They may have been used before.
            pages.bytes_mut().fill(0);
        }
        Ok(pages)
    }

    /// From now on writing ends the process. Bytes of the heap move to their own pages.
    pub(super) fn lock(&mut self) -> io::Result<()> {
        if let Place::Heap(_) = self.place {
            let page = page_size();
            let inner = self.length.next_multiple_of(page).max(page);
            let mut paged = Self {
                place: Place::Map(Map::new(inner + 2 * page, None)?),
                ..*self
            };
            paged.bytes_mut().copy_from_slice(self.bytes());
            *self = paged;
        }
        match &mut self.place {
            Place::Map(map) => map.lock(),
            Place::Heap(_) => Ok(()),
        }
    }

    pub(super) fn pointer(&self) -> *mut u8 {
        let start = match &self.place {
            Place::Map(map) => map.start(),
            Place::Heap(heap) => heap.start(),
        };
        start.wrapping_add(self.offset)
    }

    pub(super) fn bytes(&self) -> &[u8] {
        // SAFETY: `length` bytes from `offset` on are mapped, readable and initialised (zero).
        unsafe { std::slice::from_raw_parts(self.pointer(), self.length) }
    }

    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        assert!(!matches!(&self.place, Place::Map(map) if map.is_locked()));
        // SAFETY: as above, and writable.
        unsafe { std::slice::from_raw_parts_mut(self.pointer(), self.length) }
    }
}

#[derive(Debug)]
enum Place {
    Map(Map),
    Heap(Heap),
}

/// Words of the heap, which others than their owner may write.
#[derive(Debug)]
struct Heap(Box<[std::cell::UnsafeCell<u64>]>);

impl Heap {
    fn new(length: usize) -> Self {
        let words = Box::new_zeroed_slice(length.div_ceil(size_of::<u64>()));
        // SAFETY: zero is a valid `u64`, and a cell has the layout of its value.
        Self(unsafe { words.assume_init() })
    }

    fn start(&self) -> *mut u8 {
        self.0.as_ptr().cast::<u8>().cast_mut()
    }
}

#[cfg(unix)]
use of_unix::{Map, page_size};

#[cfg(unix)]
mod of_unix {
    use rustix::mm::{MapFlags, MprotectFlags, ProtFlags, mmap_anonymous, mprotect, munmap};
    use std::cell::RefCell;
    use std::io;
    use std::ptr::null_mut;

    pub(super) fn page_size() -> usize {
        rustix::param::page_size()
    }

    /// Maps that are kept for the next calls: a check makes ten thousands of them.
    const MOST_SPARE: usize = 64;

    thread_local! {
        static SPARE: RefCell<Vec<Map>> = const { RefCell::new(Vec::new()) };
    }

    /// Pages between two margins of one page each.
    #[derive(Debug)]
    pub(super) struct Map {
        start: *mut u8,
        length: usize,
        /// Where a page lies that must not be touched.
        forbidden: Option<usize>,
        is_locked: bool,
    }

    impl Map {
        /// One that was used before where there is one: its bytes are as they were left.
        pub(super) fn new(length: usize, forbidden: Option<usize>) -> io::Result<Self> {
            let spare = SPARE.try_with(|spare| {
                let mut spare = spare.borrow_mut();
                let fits = |map: &Self| (map.length, map.forbidden) == (length, forbidden);
                spare.iter().position(fits).map(|i| spare.swap_remove(i))
            });
            let access = ProtFlags::READ | ProtFlags::WRITE;
            if let Ok(Some(mut map)) = spare {
                if map.is_locked {
                    map.protect_inner(MprotectFlags::READ | MprotectFlags::WRITE)?;
                    map.is_locked = false;
                }
                return Ok(map);
            }
            // SAFETY: a new private map at an address of the system's choice touches nothing else.
            let start = unsafe { mmap_anonymous(null_mut(), length, access, MapFlags::PRIVATE)? };
            let map = Self {
                start: start.cast(),
                length,
                forbidden,
                is_locked: false,
            };
            if let Some(from) = forbidden {
                map.protect(from, page_size(), MprotectFlags::empty())?;
            }
            Ok(map)
        }

        pub(super) fn start(&self) -> *mut u8 {
            self.start
        }

        pub(super) fn is_locked(&self) -> bool {
            self.is_locked
        }

        pub(super) fn lock(&mut self) -> io::Result<()> {
            self.is_locked = true;
            self.protect_inner(MprotectFlags::READ)
        }

        fn protect_inner(&self, access: MprotectFlags) -> io::Result<()> {
            self.protect(page_size(), self.length - 2 * page_size(), access)
        }

        fn protect(&self, from: usize, length: usize, access: MprotectFlags) -> io::Result<()> {
            assert!(from + length <= self.length);
            // SAFETY: pages of this map; no reference into it is alive, since this borrows it.
            unsafe { mprotect(self.start.add(from).cast(), length, access) }?;
            Ok(())
        }
    }

    impl Drop for Map {
        fn drop(&mut self) {
            let kept = SPARE.try_with(|spare| {
                let mut spare = spare.borrow_mut();
                let fits = spare.len() < MOST_SPARE;
                if fits {
                    spare.push(Self { ..*self });
                }
                fits
            });
            if !kept.unwrap_or(false) {
                // SAFETY: the whole map, which nothing refers to any more. Failure leaks it.
                let _ = unsafe { munmap(self.start.cast(), self.length) };
            }
        }
    }
}

#[cfg(not(unix))]
use elsewhere::{Map, page_size};

#[cfg(not(unix))]
mod elsewhere {
    use std::io;

    pub(super) fn page_size() -> usize {
        4096
    }

    #[derive(Debug)]
    pub(super) struct Map(super::Heap);

    impl Map {
        #[expect(clippy::unnecessary_wraps, reason = "as on Unix")]
        pub(super) fn new(length: usize, _: Option<usize>) -> io::Result<Self> {
            Ok(Self(super::Heap::new(length)))
        }

        pub(super) fn start(&self) -> *mut u8 {
            self.0.start()
        }

        pub(super) fn is_locked(&self) -> bool {
            false
        }

        #[expect(clippy::unused_self, clippy::unnecessary_wraps, reason = "as on Unix")]
        pub(super) fn lock(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
}
