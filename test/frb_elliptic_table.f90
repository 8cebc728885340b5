!> Reader of data/elliptic/table.txt: reference values of the elliptic integrals and functions.
module frb_elliptic_table
    use frb_kinds, only: wp
    implicit none
    private

    public :: table_entry, read_table, columns_of

    type :: table_entry
        character(4) :: name = ''           !! the function
        integer :: inputs = 0               !! number of inputs
        real(wp) :: x(4) = 0.0_wp           !! the inputs
        real(wp) :: value = 0.0_wp          !! the value
    end type table_entry

contains

    !> All records; none if the file is missing.
    subroutine read_table(entries)
        type(table_entry), allocatable, intent(out) :: entries(:)
        type(table_entry) :: entry
        character(256) :: line
        integer :: unit, ios, count, pass

        allocate (entries(0))
        open (newunit=unit, file='data/elliptic/table.txt', status='old', action='read', iostat=ios)
        if (ios /= 0) return
        do pass = 1, 2
            count = 0
            do
                read (unit, '(a)', iostat=ios) line
                if (ios /= 0) exit
                read (line, *, iostat=ios) entry%name, entry%inputs
                if (ios /= 0) cycle
                count = count + 1
                if (pass == 1) cycle
                read (line, *) entry%name, entry%inputs, entry%x(1:entry%inputs), entry%value
                entries(count) = entry
            end do
            rewind (unit)
            if (pass == 1) then
                deallocate (entries)
                allocate (entries(count))
            end if
        end do
        close (unit)
    end subroutine read_table

    !> The records of one function, as columns.
    subroutine columns_of(entries, name, x, values)
        type(table_entry), intent(in) :: entries(:)
        character(*), intent(in) :: name
        real(wp), allocatable, intent(out) :: x(:, :)     !! inputs, one record a row
        real(wp), allocatable, intent(out) :: values(:)
        integer :: i, row

        allocate (x(count(entries%name == name), 4), values(count(entries%name == name)))
        row = 0
        do i = 1, size(entries)
            if (entries(i)%name == name) then
                row = row + 1
                x(row, :) = entries(i)%x
                values(row) = entries(i)%value
            end if
        end do
    end subroutine columns_of

end module frb_elliptic_table
