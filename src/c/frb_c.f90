!> The C interface, described in frb.h: bodies and motions are values of fixed size in the caller's memory,
!> every refusal is a status, nothing stops or prints. A bind(C) name must not be the name of a module: both
!> are global names, and gfortran mixes them up without a message.
module frb_c
    use frb_c_memory, only: triple, quadruple, matrix, find_state, store_body, usable, all_usable, copied
    use frb_flow_bodies, only: flow_rows
    use frb_flow_one, only: flow_body
    use frb_free_flow, only: rigid_body
    use frb_free_motion, only: free_motion
    use frb_inertia, only: axes_of, body_core, core_from_moments, core_from_tensor
    use frb_status, only: status_message, status_ok, status_bad_moments, status_bad_tensor, &
        status_bad_momentum, status_bad_time, status_bad_count
    use frb_release, only: version
    use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_loc, c_ptr, &
        c_size_t
    implicit none
    private

    !> Sizes of the opaque types of frb.h, in doubles; a motion has room to spare.
    integer, parameter :: body_doubles = 39, motion_doubles = 69
    !> Bodies gathered at a time where memory has other strides than the library.
    integer, parameter :: chunk = 64

    !> Stands in every motion that `frb_motion_start` made: memory that C never set does not hold it.
    integer(c_int), parameter :: seal_of_motions = 1713044275_c_int
    !> The motion and its seal.
    type :: sealed_motion
        integer(c_int) :: seal = seal_of_motions
        type(free_motion) :: motion
    end type sealed_motion

contains

    !> A body from its principal moments.
    function c_body_from_moments(moments, body) bind(c, name='frb_body_from_moments') result(stat)
        type(c_ptr), value :: moments, body
        integer(c_int) :: stat
        type(triple), pointer :: three

        stat = status_bad_moments
        if (.not. (c_associated(moments) .and. c_associated(body))) return
        call c_f_pointer(moments, three)
        call store_body(core_from_moments(three%x), body, stat)
    end function c_body_from_moments

    !> A body from its inertia tensor, which is symmetric: rows and columns may change places.
    function c_body_from_tensor(tensor, body) bind(c, name='frb_body_from_tensor') result(stat)
        type(c_ptr), value :: tensor, body
        integer(c_int) :: stat
        type(matrix), pointer :: nine

        stat = status_bad_tensor
        if (.not. (c_associated(tensor) .and. c_associated(body))) return
        call c_f_pointer(tensor, nine)
        call store_body(core_from_tensor(nine%x), body, stat)
    end function c_body_from_tensor

    !> Moments of a body, and its principal axes when asked for.
    function c_body_axes(body, moments, axes) bind(c, name='frb_body_axes') result(stat)
        type(c_ptr), value :: body, moments, axes
        integer(c_int) :: stat
        type(body_core), pointer :: core
        type(triple), pointer :: three
        type(matrix), pointer :: nine

        stat = status_bad_moments
        if (.not. (c_associated(body) .and. c_associated(moments))) return
        call c_f_pointer(body, core)
        if (.not. usable(core)) return
        stat = core%status
        call c_f_pointer(moments, three)
        three%x = core%moments
        if (.not. c_associated(axes)) return
        call c_f_pointer(axes, nine)
        ! C stores row after row.
        nine%x = transpose(axes_of(core))
    end function c_body_axes

    !> The flow of one body.
    function c_flow(body, h, m, q) bind(c, name='frb_flow') result(stat)
        type(c_ptr), value :: body, m, q
        real(c_double), value :: h
        integer(c_int) :: stat
        type(body_core), pointer :: core
        type(triple), pointer :: m3
        type(quadruple), pointer :: q4
        integer :: code

        stat = status_bad_moments
        if (.not. c_associated(body)) return
        call c_f_pointer(body, core)
        if (.not. usable(core)) return
        stat = status_bad_momentum
        if (.not. c_associated(m)) return
        call c_f_pointer(m, m3)
        if (c_associated(q)) then
            call c_f_pointer(q, q4)
            call flow_body(core, h, m3%x, code, q4%x)
        else
            call flow_body(core, h, m3%x, code)
        end if
        stat = int(code, c_int)
    end function c_flow

    !> The flow of n bodies.
    function c_flow_many(body, ldb, h, n, m, ldm, q, ldq) bind(c, name='frb_flow_many') result(stat)
        type(c_ptr), value :: body, m, q
        integer(c_size_t), value :: ldb, n, ldm, ldq
        real(c_double), value :: h
        integer(c_int) :: stat
        type(body_core), pointer :: core(:)
        real(c_double), pointer, contiguous :: words(:, :), m_of(:, :), q_of(:, :)
        integer :: bodies, code
        logical :: packed

        stat = status_bad_moments
        if (.not. c_associated(body)) return
        stat = status_bad_count
        if (.not. (in_range(n, 0) .and. in_range(ldm, 3))) return
        if (ldb /= 0 .and. .not. in_range(ldb, body_doubles)) return
        if (c_associated(q) .and. .not. in_range(ldq, 4)) return
        stat = status_ok
        if (n == 0) return
        stat = status_bad_momentum
        if (.not. c_associated(m)) return
        call c_f_pointer(m, m_of, [ldm, n])
        nullify (q_of)
        if (c_associated(q)) call c_f_pointer(q, q_of, [ldq, n])
        bodies = merge(1, int(n), ldb == 0)
        packed = ldb == 0 .or. ldb == body_doubles
        if (packed) then
            call c_f_pointer(body, core, [bodies])
            packed = all_usable(core)
        end if
        if (packed) then
            call flow_rows(core, ldb == 0, [h], int(n), ldm, ldq, m_of, code, q_of)
        else
            call c_f_pointer(body, words, [max(ldb, int(body_doubles, c_size_t)), int(bodies, c_size_t)])
            call flow_strided(words, ldb == 0, h, int(n), ldm, ldq, m_of, code, q_of)
        end if
        stat = int(code, c_int)
    end function c_flow_many

    !> The flow of n bodies that are not packed, or were not made: the bodies are copied in chunks.
    subroutine flow_strided(words, alike, h, n, ldm, ldq, m, code, q)
        real(c_double), intent(in), target :: words(:, :)   !! bodies: one, or as many as states
        logical, intent(in) :: alike                        !! the first is meant for all
        real(c_double), intent(in) :: h
        integer, intent(in) :: n
        integer(c_size_t), intent(in) :: ldm, ldq
        real(c_double), intent(inout) :: m(ldm, n)
        integer, intent(out) :: code
        real(c_double), intent(inout), optional :: q(ldq, n)
        type(body_core), pointer :: given
        type(body_core) :: part(chunk)
        integer :: first, count, bodies, code_here, i

        code = status_ok
        bodies = 1
        do first = 1, n, chunk
            count = min(chunk, n - first + 1)
            if (size(words, 2) > 1 .or. first == 1) then
                bodies = min(count, size(words, 2))
                do i = 1, bodies
                    call c_f_pointer(c_loc(words(1, first + i - 1)), given)
                    part(i) = body_core()
                    if (usable(given)) part(i) = given
                end do
            end if
            if (present(q)) then
                call flow_rows(part(:bodies), alike, [h], count, ldm, ldq, m(1, first), code_here, &
                               q(1, first))
            else
                call flow_rows(part(:bodies), alike, [h], count, ldm, ldq, m(1, first), code_here)
            end if
            code = max(code, code_here)
        end do
    end subroutine flow_strided

    !> Sets up a free motion.
    function c_motion_start(body, m, q, motion) bind(c, name='frb_motion_start') result(stat)
        type(c_ptr), value :: body, m, q, motion
        integer(c_int) :: stat
        type(rigid_body), pointer :: whole_body
        type(triple), pointer :: m3
        type(quadruple), pointer :: q4
        type(sealed_motion), pointer :: sealed

        stat = status_bad_count
        if (.not. c_associated(motion)) return
        call c_f_pointer(motion, sealed)
        sealed%seal = 0
        call find_state(body, m, q, whole_body, m3, q4, stat)
        if (stat /= status_ok) return
        sealed%motion = free_motion(whole_body, m3%x, q4%x)
        sealed%seal = seal_of_motions
        stat = int(sealed%motion%status, c_int)
    end function c_motion_start

    !> The state at n times.
    function c_motion_at(motion, n, t, m, ldm, q, ldq) bind(c, name='frb_motion_at') result(stat)
        type(c_ptr), value :: motion, t, m, q
        integer(c_size_t), value :: n, ldm, ldq
        integer(c_int) :: stat
        type(sealed_motion), pointer :: sealed
        real(c_double), pointer, contiguous :: t_of(:), m_of(:, :), q_of(:, :)
        integer :: i, code

        stat = status_of(motion, sealed)
        if (stat /= status_ok) return
        stat = status_bad_count
        if (.not. (in_range(n, 0) .and. in_range(ldm, 3))) return
        if (c_associated(q) .and. .not. in_range(ldq, 4)) return
        stat = status_ok
        if (n == 0) return
        stat = status_bad_time
        if (.not. c_associated(t)) return
        stat = status_bad_momentum
        if (.not. c_associated(m)) return
        call c_f_pointer(t, t_of, [n])
        call c_f_pointer(m, m_of, [ldm, n])
        if (c_associated(q)) call c_f_pointer(q, q_of, [ldq, n])
        stat = status_ok
        do i = 1, int(n)
            if (c_associated(q)) then
                call sealed%motion%at(t_of(i), m_of(:3, i), q_of(:4, i), code)
            else
                call sealed%motion%at(t_of(i), m_of(:3, i), stat=code)
            end if
            stat = max(stat, int(code, c_int))
        end do
    end function c_motion_at

    !> Period of the momentum, and the precession in it.
    function c_motion_period(motion, period, precession) bind(c, name='frb_motion_period') result(stat)
        type(c_ptr), value :: motion, period, precession
        integer(c_int) :: stat
        type(sealed_motion), pointer :: sealed
        real(c_double), pointer :: number

        stat = status_of(motion, sealed)
        if (stat /= status_ok) return
        if (c_associated(period)) then
            call c_f_pointer(period, number)
            number = sealed%motion%period()
        end if
        if (c_associated(precession)) then
            call c_f_pointer(precession, number)
            number = sealed%motion%precession()
        end if
    end function c_motion_period

    !> The text of a status.
    function c_status_message(code, text, size) bind(c, name='frb_status_message') result(length)
        integer(c_int), value :: code
        type(c_ptr), value :: text
        integer(c_size_t), value :: size
        integer(c_size_t) :: length

        length = copied(status_message(int(code)), text, size)
    end function c_status_message

    !> The version of the library.
    function c_version(text, size) bind(c, name='frb_version') result(length)
        type(c_ptr), value :: text
        integer(c_size_t), value :: size
        integer(c_size_t) :: length

        length = copied(version, text, size)
    end function c_version

    !> Bytes of a body: those of frb.h, or this does not compile.
    pure function c_body_bytes() bind(c, name='frb_body_bytes') result(bytes)
        integer(c_size_t) :: bytes
        type(rigid_body) :: body
        integer, parameter :: fits = 1/merge(1, 0, storage_size(body) == 64*body_doubles)

        bytes = fits*8*body_doubles
    end function c_body_bytes

    !> Bytes of a motion: no more than those of frb.h, or this does not compile.
    pure function c_motion_bytes() bind(c, name='frb_motion_bytes') result(bytes)
        integer(c_size_t) :: bytes
        type(sealed_motion) :: motion
        integer, parameter :: fits = 1/merge(1, 0, storage_size(motion) <= 64*motion_doubles)

        bytes = fits*8*motion_doubles
    end function c_motion_bytes

    !> Whether a size is at least `least` and no more than the largest default integer.
    pure function in_range(number, least) result(yes)
        integer(c_size_t), intent(in) :: number
        integer, intent(in) :: least
        logical :: yes

        yes = number >= least .and. number < huge(least) - chunk
    end function in_range

    !> `status_ok` and the motion, or why it cannot be used.
    function status_of(motion, sealed) result(stat)
        type(c_ptr), intent(in) :: motion
        type(sealed_motion), pointer, intent(out) :: sealed
        integer(c_int) :: stat

        stat = status_bad_moments
        nullify (sealed)
        if (.not. c_associated(motion)) return
        call c_f_pointer(motion, sealed)
        if (sealed%seal == seal_of_motions) stat = int(sealed%motion%status, c_int)
    end function status_of

end module frb_c
