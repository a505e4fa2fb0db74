//! Memory in large pages: traversal touches nodes all over the tree, and address translation would cost as much as the
//! data.
#![allow(unsafe_code)]

/// Asks the system to back `items` and its spare capacity with large pages, as far as they are not in use yet.
fn advise<T>(items: &mut Vec<T>) {
    #[cfg(target_os = "linux")]
    {
        const PAGE: usize = 4096;
        let start = items.as_ptr() as usize;
        let end = start + items.capacity() * size_of::<T>();
        let (start, end) = (start.next_multiple_of(PAGE), end / PAGE * PAGE);
        if start < end {
            // SAFETY: the range belongs to the vector's allocation, and the advice does not change what it holds. If it
            // is refused, the pages stay small.
            unsafe { libc::madvise(start as *mut libc::c_void, end - start, libc::MADV_HUGEPAGE) };
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = items;
}

/// The same items without spare capacity, in large pages where the system has them.
pub(in super::super) fn compact<T: Copy>(items: Vec<T>) -> Vec<T> {
    let mut compacted = Vec::with_capacity(items.len());
    advise(&mut compacted);
    compacted.extend_from_slice(&items);
    compacted
}
