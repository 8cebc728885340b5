!> Access of the C interface to the caller's memory: numbers, bodies, texts.
module frb_c_memory
    use frb_free_flow, only: rigid_body
    use frb_inertia, only: body_core
    use frb_status, only: status_ok, status_bad_moments, status_bad_momentum, status_bad_attitude
    use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int, c_null_char, &
        c_ptr, c_size_t
    implicit none
    private

    public :: triple, quadruple, matrix, find_state, store_body, usable, all_usable, copied

    !> Three numbers.
    type, bind(c) :: triple
        real(c_double) :: x(3)
    end type triple

    !> A quaternion.
    type, bind(c) :: quadruple
        real(c_double) :: x(4)
    end type quadruple

    !> A 3 x 3 matrix.
    type, bind(c) :: matrix
        real(c_double) :: x(3, 3)
    end type matrix

contains

    !> The body, momentum and attitude that the caller's pointers lead to, or the status of the first that is
    !> missing.
    subroutine find_state(body, m, q, whole_body, m3, q4, stat)
        type(c_ptr), intent(in) :: body, m, q
        type(rigid_body), pointer, intent(out) :: whole_body
        type(triple), pointer, intent(out) :: m3
        type(quadruple), pointer, intent(out) :: q4
        integer(c_int), intent(out) :: stat
        type(body_core), pointer :: core

        nullify (whole_body, m3, q4)
        stat = status_bad_moments
        if (.not. c_associated(body)) return
        call c_f_pointer(body, core)
        if (.not. usable(core)) return
        call c_f_pointer(body, whole_body)
        stat = status_bad_momentum
        if (.not. c_associated(m)) return
        call c_f_pointer(m, m3)
        stat = status_bad_attitude
        if (.not. c_associated(q)) return
        call c_f_pointer(q, q4)
        stat = status_ok
    end subroutine find_state

    !> Puts a body into the caller's memory and tells its status.
    subroutine store_body(made, body, stat)
        type(body_core), intent(in) :: made
        type(c_ptr), intent(in) :: body
        integer(c_int), intent(out) :: stat
        type(body_core), pointer :: core

        call c_f_pointer(body, core)
        core = made
        stat = made%status
    end subroutine store_body

    !> Whether memory holds a body, made or refused: memory that C never set holds no order of the axes.
    pure function usable(core) result(yes)
        type(body_core), intent(in) :: core
        logical :: yes

        yes = core%status >= status_ok .and. is_axis(core%order(1)) .and. is_axis(core%order(2)) &
            .and. is_axis(core%order(3))
        if (yes .and. core%status == status_ok) yes = core%a(3) > 0.0_c_double
    end function usable

    !> Whether all cores are usable.
    pure function all_usable(core) result(yes)
        type(body_core), intent(in) :: core(:)
        logical :: yes
        integer :: i

        yes = .true.
        do i = 1, size(core)
            yes = yes .and. usable(core(i))
        end do
    end function all_usable

    !> Whether a number is that of an axis, 1 to 3.
    pure function is_axis(i) result(yes)
        integer(c_int), intent(in) :: i
        logical :: yes

        yes = i >= 1 .and. i <= 3
    end function is_axis

    !> Puts a text into the caller's memory, ended by a null, as much as fits; gives its whole length.
    function copied(text, memory, size) result(length)
        character(*), intent(in) :: text
        type(c_ptr), intent(in) :: memory
        integer(c_size_t), intent(in) :: size
        integer(c_size_t) :: length
        character(kind=c_char), pointer :: letters(:)
        integer :: i, count

        length = len(text, c_size_t)
        if (.not. c_associated(memory) .or. size < 1) return
        count = int(min(length, size - 1))
        call c_f_pointer(memory, letters, [count + 1])
        do i = 1, count
            letters(i) = text(i:i)
        end do
        letters(count + 1) = c_null_char
    end function copied

end module frb_c_memory
