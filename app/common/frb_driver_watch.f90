!> What a driver reports about its run: progress during the run, then a summary of the time spent and of the
!> errors in the constants of the motion.
module frb_driver_watch
    use frb_driver_command, only: fail
    use frb_kinds, only: wp
    use frb_out_files, only: out_file
    use frb_rotations, only: norm3, quat_rotate
    use frb_system, only: c_isatty
    use, intrinsic :: iso_c_binding, only: c_int
    use, intrinsic :: iso_fortran_env, only: error_unit, int64
    implicit none
    private

    public :: run_watch

    !> Largest differences from the first record, and the time spent.
    type :: run_watch
        integer, private :: steps = 0               !! of the whole run
        integer, private :: done = 0
        integer(int64), private :: ticks = 0        !! spent in steps
        integer(int64), private :: step_begun = 0, run_begun = 0, last_shown = 0
        logical, private :: shows_progress = .false.
        real(wp), private :: norm0 = 0.0_wp, space0(3) = 0.0_wp, energy0 = 0.0_wp, energy_scale = 1.0_wp
        real(wp), private :: norm_drift = 0.0_wp, space_drift = 0.0_wp, defect = 0.0_wp
        real(wp), private :: energy_drift(2) = 0.0_wp   !! in the first and in the second half of the run
        logical, private :: torque = .false.
        real(wp), private :: up(3) = 0.0_wp, vertical_drift = 0.0_wp
    contains
        procedure :: begin
        procedure :: begin_step
        procedure :: end_step
        procedure :: finish
        procedure, private :: note_record
        procedure, private :: note_matrix
        procedure, private :: note_quaternion
        generic :: note => note_matrix, note_quaternion
        procedure, private :: show_progress
    end type run_watch

contains

    !> Starts the watch over a run of `steps` steps. With `u0`, gravity in space, the run is a heavy top's:
    !> the energy is then T + u0.(Q e3), and of Q m only the part along u0 is a constant.
    subroutine begin(self, steps, u0)
        class(run_watch), intent(inout) :: self
        integer, intent(in) :: steps
        real(wp), intent(in), optional :: u0(3)

        self%steps = steps
        self%done = 0
        self%torque = present(u0)
        if (present(u0)) self%up = u0
        self%shows_progress = c_isatty(2_c_int) == 1_c_int
        call system_clock(self%run_begun)
        self%last_shown = self%run_begun
    end subroutine begin

    !> Call before a step.
    subroutine begin_step(self)
        class(run_watch), intent(inout) :: self

        call system_clock(self%step_begun)
    end subroutine begin_step

    !> Call after a step; shows progress about once a second if standard error is a terminal.
    subroutine end_step(self)
        class(run_watch), intent(inout) :: self
        integer(int64) :: time

        call system_clock(time)
        self%ticks = self%ticks + (time - self%step_begun)
        self%done = self%done + 1
        if (self%shows_progress) call self%show_progress(time)
    end subroutine end_step

    !> Watches a record with the attitude as a matrix.
    subroutine note_matrix(self, m, attitude, moments)
        class(run_watch), intent(inout) :: self
        real(wp), intent(in) :: m(3), attitude(3, 3), moments(3)
        real(wp) :: square(3, 3)
        integer :: i

        square = matmul(transpose(attitude), attitude)
        do i = 1, 3
            square(i, i) = square(i, i) - 1
        end do
        call self%note_record(m, matmul(attitude, m), moments, attitude(:, 3), maxval(abs(square)))
    end subroutine note_matrix

    !> Watches a record with the attitude as a quaternion.
    subroutine note_quaternion(self, m, q, moments)
        class(run_watch), intent(inout) :: self
        real(wp), intent(in) :: m(3), q(4), moments(3)

        call self%note_record(m, quat_rotate(q, m), moments, [0.0_wp, 0.0_wp, 0.0_wp], abs(norm2(q) - 1))
    end subroutine note_quaternion

    !> Compares a record with the first one.
    subroutine note_record(self, m, space, moments, axis, defect)
        class(run_watch), intent(inout) :: self
        real(wp), intent(in) :: m(3), moments(3)
        real(wp), intent(in) :: space(3)    !! Q m
        real(wp), intent(in) :: axis(3)     !! Q e3
        real(wp), intent(in) :: defect      !! distance of the attitude from orthogonal, or from norm one
        real(wp) :: kinetic, potential
        integer :: half

        kinetic = sum(m*(m/moments))/2
        potential = 0.0_wp
        if (self%torque) potential = dot_product(self%up, axis)
        if (self%done == 0) then
            self%norm0 = norm3(m)
            self%space0 = space
            self%energy0 = kinetic + potential
            self%energy_scale = kinetic + abs(potential)
        end if
        self%norm_drift = max(self%norm_drift, abs(norm3(m) - self%norm0))
        self%space_drift = max(self%space_drift, norm3(space - self%space0))
        if (self%torque) then
            self%vertical_drift = max(self%vertical_drift, abs(dot_product(self%up, space - self%space0)))
        end if
        half = merge(1, 2, self%done <= self%steps/2)
        self%energy_drift(half) = max(self%energy_drift(half), abs(kinetic + potential - self%energy0))
        self%defect = max(self%defect, defect)
    end subroutine note_record

    !> Ends a run: the output gets its name, then a summary goes to standard output, or to standard error
    !> where standard output has the records.
    subroutine finish(self, title, h, out)
        class(run_watch), intent(inout) :: self
        character(*), intent(in) :: title
        real(wp), intent(in) :: h
        type(out_file), intent(inout) :: out
        type(out_file) :: summary
        character(:), allocatable :: error
        integer(int64) :: time, rate
        real(wp) :: size_of_m, size_of_up
        character(120) :: text

        call out%commit(error)
        if (allocated(error)) call fail(error)
        call system_clock(time, rate)
        if (self%last_shown > self%run_begun) write (error_unit, '(a)') achar(13)//'steps done: all        '
        size_of_m = positive(self%norm0)
        call summary%open_for_writing(trim(merge('/dev/stderr', '-          ', out%descriptor == 1)), error)
        if (allocated(error)) call fail(error)
        call summary%write_line(title)
        write (text, '(a,i0,2(a,es11.4))') '  steps                      ', self%steps, ' of h =', h, &
            ', to t =', self%steps*h
        call summary%write_line(trim(text))
        call line('  time per step', real(self%ticks, wp)/real(rate, wp)/max(1, self%done), ' s')
        call line('  time of the run', real(time - self%run_begun, wp)/real(rate, wp), ' s, with writing')
        call summary%write_line('  largest change over the run, relative:')
        if (self%torque) then
            size_of_up = positive(norm3(self%up))
            call line('    |m| (turned by torque)', self%norm_drift/size_of_m)
            call line('    Q m (turned by torque)', self%space_drift/size_of_m)
            call line('    Q m along u0', self%vertical_drift/size_of_up/size_of_m)
            call line('    energy, first half', self%energy_drift(1)/positive(self%energy_scale))
            call line('    energy, second half', self%energy_drift(2)/positive(self%energy_scale))
        else
            call line('    |m|', self%norm_drift/size_of_m)
            call line('    Q m', self%space_drift/size_of_m)
            call line('    energy', maxval(self%energy_drift)/positive(self%energy_scale))
        end if
        call line('  attitude off orthogonal by', self%defect)
        call summary%write_line('  written to                 '//out%path)
        call summary%commit(error)
        if (allocated(error)) call fail('the summary: '//error)

    contains

        !> One line of the summary.
        subroutine line(name, value, unit)
            character(*), intent(in) :: name
            real(wp), intent(in) :: value
            character(*), intent(in), optional :: unit
            character(29) :: padded

            padded = name
            write (text, '(a,es10.3)') padded, value
            if (present(unit)) text = trim(text)//unit
            call summary%write_line(trim(text))
        end subroutine line

    end subroutine finish

    !> A scale to divide by: one where the scale is zero.
    pure function positive(scale)
        real(wp), intent(in) :: scale
        real(wp) :: positive

        positive = merge(scale, 1.0_wp, scale > tiny(1.0_wp))
    end function positive

    !> Shows how far the run is, about once a second.
    subroutine show_progress(self, time)
        class(run_watch), intent(inout) :: self
        integer(int64), intent(in) :: time
        integer(int64) :: rate, unused

        if (self%done == self%steps) return
        call system_clock(unused, rate)
        if (time - self%last_shown < rate) return
        self%last_shown = time
        write (error_unit, '(a,i0,a,i0)', advance='no') achar(13)//'steps done: ', self%done, &
            ' of ', self%steps
        flush (error_unit)
    end subroutine show_progress

end module frb_driver_watch
